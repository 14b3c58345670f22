"""Tip deflection under each law, and the errors of the trials that learn."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

import jaxflex as jf

from ..pictures import figure


def responses(runs: Mapping[str, jf.Trajectory], errors: Mapping[str, np.ndarray], end: float) -> Figure:
    """Deflections of the continuous laws on the left, errors [mrad] of the trials on the right."""
    made, axes = figure(1, 2, height=4.0, width=11.0)
    left, right = axes[0]
    for i, (name, run) in enumerate(runs.items()):
        left.plot(
            np.asarray(run.times),
            1e3 * np.asarray(run["tip_deflection_1"]),
            f"C{i}",
            label=name,
            linewidth=1.2,
        )
    left.axvline(end, color="0.4", linestyle=":", linewidth=1)
    left.set_xlabel("time [s] (dotted: end of the move)")
    left.set_ylabel("tip deflection [mm]")
    left.legend(frameon=False, fontsize=7)
    for name, row in errors.items():
        right.semilogy(np.arange(1, len(row) + 1), row, "o-", label=name)
    right.legend(frameon=False, fontsize=7)
    right.set_xlabel("trial")
    right.set_ylabel("rms error of the joint [mrad]")
    right.set_title("PD with a learnt feedforward", fontsize=9)
    return made
