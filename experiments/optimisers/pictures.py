"""Best cost against simulations and against time."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from ..pictures import figure


def race(traces: Mapping[str, Sequence[np.ndarray]], simulations: float, seconds: float) -> Figure:
    """Median over the starts as a line, the range from best to worst as a band."""
    made, axes = figure(1, 2, height=4.0)
    ends = ((0, simulations, "simulations (a gradient counts as one for each parameter, and one)"),
            (1, seconds, "processor time of one core, without compilation [s]"))  # fmt: skip
    for axis, (column, end, label) in zip(axes[0], ends, strict=True):
        grid = np.geomspace(end / 300, end, 200)
        for number, (name, found) in enumerate(traces.items()):
            curves = np.stack([held(trace[:, column], trace[:, 2], grid) for trace in found])
            known = np.all(np.isfinite(curves), axis=0)
            axis.fill_between(
                grid[known],
                curves.min(0)[known],
                curves.max(0)[known],
                color=f"C{number}",
                alpha=0.13,
                linewidth=0,
            )
            axis.plot(
                grid[known], np.median(curves, axis=0)[known], color=f"C{number}", label=name, linewidth=1.8
            )
        axis.set_xscale("log")
        axis.set_ylim(-6.2, -2.0)  # the starts, some of which fail, cost up to 70
        axis.set_xlabel(label)
    axes[0, 0].set_ylabel("best cost so far (logarithmic) [1]")
    axes[0, 0].legend(frameon=False, fontsize=8)
    return made


def held(at: np.ndarray, values: np.ndarray, grid: np.ndarray) -> np.ndarray:
    """The last value at or before every point of the grid; NaN before the first."""
    index = np.searchsorted(at, grid, side="right") - 1
    return np.where(index >= 0, values[np.maximum(index, 0)], np.nan)
