"""Pictures of the benchmarks."""

import numpy as np
from matplotlib.figure import Figure

from ..pictures import MEASURED, OURS, THEIRS, figure

COLOURS = {"jaxflex": OURS, "vector C": MEASURED, "scalar C": THEIRS}


def plot_work_precision(found: dict) -> Figure:
    """Error of the tip against seconds, by program and method."""
    made, axes = figure(1, 1, height=4.2, width=6.5)
    axis = axes[0, 0]
    groups: dict[tuple[str, str], list] = {}
    for row in found["rows"]:
        if np.isfinite(row["tip error [m]"]):
            key = row["program"], row["setting"].partition(",")[0]
            groups.setdefault(key, []).append((row["seconds"], row["tip error [m]"]))
    for (program, method), points in groups.items():
        x, y = np.array(sorted(points)).T
        style = "o-" if method != "RK4" else "s--"
        axis.loglog(x, y, style, color=COLOURS[program], label=f"{program}, {method}")
    axis.axhline(1e-5, color="0.5", linewidth=0.8)
    axis.annotate(
        "allowed", (1, 1e-5), xycoords=("axes fraction", "data"), ha="right", va="bottom", fontsize=7
    )
    axis.set_xlabel(f"seconds for {found['arms']} arms over 2 s")
    axis.set_ylabel("largest error of the tip [m]")
    axis.legend(fontsize=8)
    return made


def plot_scaling(found: dict) -> Figure:
    """Microseconds an arm against the number of arms."""
    made, axes = figure(1, 1, height=3.6, width=6.5)
    axis = axes[0, 0]
    counts = found["microseconds an arm"]
    axis.loglog([int(c) for c in counts], list(counts.values()), "o-", color=OURS)
    axis.set_xlabel("arms in the sweep")
    axis.set_ylabel("microseconds an arm, 2 s of motion")
    return made


def plot_gradients(found: dict) -> Figure:
    """Gradient over cost against the number of parameters."""
    made, axes = figure(1, 1, height=3.6, width=6.5)
    axis, rows = axes[0, 0], found["rows"]
    counts = [row["parameters"] for row in rows]
    for mode, colour in (("forward", OURS), ("reverse", MEASURED)):
        axis.loglog(counts, [row[f"{mode} / cost"] for row in rows], "o-", color=colour, label=mode)
    axis.set_xlabel("parameters")
    axis.set_ylabel("gradient over cost, seconds")
    axis.legend(fontsize=8)
    return made
