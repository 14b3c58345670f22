"""Residual vibration on arms that a design was not tuned on."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from ..pictures import figure

LABELS = {
    "payload": ("payload [g]", 1e3),
    "stiffness": ("stiffness, share of that tuned on", 1.0),
    "damping": ("damping, share of that tuned on", 1.0),
}


def robustness(
    places: Mapping[str, np.ndarray],
    curves: Mapping[str, np.ndarray],
    names: Sequence[str],
    tuned_on: Sequence[float],
) -> Figure:
    """A panel for each thing that varies, a line for each design, residual vibration in mm."""
    made, axes = figure(1, len(places), height=3.8)
    for axis, what in zip(axes[0], places, strict=True):
        label, scale = LABELS[what]
        for i, (name, row) in enumerate(zip(names, curves[what], strict=True)):
            axis.semilogy(scale * places[what], row, color=f"C{i}", label=name, linewidth=1.6)
        marks = [scale * m for m in tuned_on] if what == "payload" else [1.0]
        for mark in marks:
            axis.axvline(mark, color="0.5", linewidth=0.8, linestyle=":")
        if what == "damping":
            axis.set_xscale("log")
            axis.set_xticks([0.2, 0.5, 1, 2, 5], ["0.2", "0.5", "1", "2", "5"])
            axis.minorticks_off()
        axis.set_ylim(0.03, 100)
        axis.yaxis.set_major_formatter("{x:g}")
        axis.yaxis.set_minor_formatter("")
        axis.set_xlabel(label)
    axes[0, 0].set_ylabel("residual tip vibration [mm]")
    axes[0, 0].set_title("dotted: tuned on", fontsize=8, loc="left")
    axes[0, 1].legend(frameon=False, fontsize=7, loc="lower left")
    return made
