"""Pictures of the benchmarks."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from ..pictures import MEASURED, OURS, THEIRS, figure

COLOURS = {
    "jaxflex": OURS, "vector C": MEASURED, "scalar C": THEIRS, "numba": "tab:olive", "SciPy": "tab:brown",
    "MuJoCo": "tab:purple", "Exudyn": "tab:pink",
}  # fmt: skip
MARKERS = {"RK45": "v", "DOP853": "^", "LSODA": "D", "Radau": "P", "BDF": "X"}  # of SciPy
METHODS = {
    "explicit, adaptive": MEASURED, "implicit, adaptive": "tab:purple", "explicit, fixed": THEIRS,
    "linearly implicit, fixed": OURS, "exact": "k",
}  # fmt: skip


def plot_work_precision(found: dict) -> Figure:
    """Error of the tip against seconds, by program and method."""
    made, axes = figure(1, 1, height=4.8, width=7.5)
    axis = axes[0, 0]
    groups: dict[tuple[str, str], list] = {}
    for row in found["rows"]:
        if np.isfinite(row["tip error [m]"]):
            key = row["program"], row["setting"].partition(",")[0]
            groups.setdefault(key, []).append((row["seconds"], row["tip error [m]"]))
    for (program, method), points in groups.items():
        x, y = np.array(sorted(points)).T
        style = "o-" if program == "jaxflex" and method != "RK4" else MARKERS.get(method, "s") + "--"
        axis.loglog(x, y, style, color=COLOURS[program], label=f"{program}, {method}")
    axis.axhline(1e-5, color="0.5", linewidth=0.8)
    axis.annotate(
        "allowed", (1, 1e-5), xycoords=("axes fraction", "data"), ha="right", va="bottom", fontsize=7
    )
    axis.set_xlabel(f"seconds for {found['arms']} arms over 2 s")
    axis.set_ylabel("largest error of the tip [m]")
    axis.legend(fontsize=7, loc="center left", bbox_to_anchor=(1, 0.5))
    return made


def plot_choice(found: dict) -> Figure:
    """Error of the tip against seconds, one panel a kind of loop."""
    names = [name for name in found if name != "machine"]
    made, axes = figure(1, len(names), height=3.4, width=2.9 * len(names))
    for axis, name in zip(axes[0], names, strict=True):
        for method, colour in METHODS.items():
            rows = [r for r in found[name]["rows"] if r["method"] == method and r["seconds"]]
            points = [(r["seconds"], max(r["tip error [m]"], 1e-15)) for r in rows]
            if points:
                axis.loglog(*np.array(sorted(points)).T, "o-", color=colour, label=method, markersize=4)
        axis.axhline(1e-5, color="0.5", linewidth=0.8)
        axis.set_title(name)
        axis.set_xlabel("seconds for 32 arms over 1 s")
        axis.xaxis.set_minor_formatter(NullFormatter())
    axes[0, 0].set_ylabel("largest error of the tip [m]")
    handles = {label: h for a in axes[0] for h, label in zip(*a.get_legend_handles_labels(), strict=True)}
    made.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=5, fontsize=8)
    return made


def plot_sizes(found: dict) -> Figure:
    """A right-hand side and its compilation against links and modes."""
    made, axes = figure(1, 2, height=3.4, width=9.0)
    for key, axis in (("microseconds", axes[0, 0]), ("seconds to compile", axes[0, 1])):
        for by, fixed, colour in (("links", "modes", OURS), ("modes", "links", MEASURED)):
            rows = sorted((r for r in found["rows"] if r[fixed] == 2), key=lambda r, by=by: r[by])
            label = f"{by}, with two {fixed}"
            axis.semilogy([r[by] for r in rows], [r[key] for r in rows], "o-", color=colour, label=label)
        axis.set_xlabel("number of them")
        axis.set_ylabel(f"{key} of a right-hand side" if key == "microseconds" else key)
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
    axis.set_ylabel("time of gradient over time of cost")
    axis.legend(fontsize=8)
    return made
