"""One picture of a run, simulated or measured, by one call."""

import numpy as np
from matplotlib.figure import Figure

from .files.recording import Recording
from .plotting import TITLES, panels
from .sensors import unit
from .simulation.trajectory import Trajectory

_ORDER = (
    "angle", "tip_deflection", "tip", "voltage", "current", "torque", "rate", "strain", "tip_acceleration",
)  # fmt: skip


def plot(run: Trajectory | Recording, title: str = "") -> Figure:
    """Angles with their references, deflections, what the motors do, the tip's path in time.

    A panel for every kind of channel that `run` has. Members of a batch are drawn over each
    other. The figure shows itself at the end of a notebook's cell; `.savefig(path)` writes it.
    """
    groups: dict[str, list[str]] = {}
    for name in run.channels:
        groups.setdefault("tip" if name in ("tip_x", "tip_y") else name.rpartition("_")[0], []).append(name)
    shown = [kind for kind in _ORDER if kind in groups]
    if not shown:
        raise ValueError(f"nothing to plot: there is no channel of {', '.join(_ORDER)}.")
    figure, axes = panels((len(shown) + 1) // 2, min(2, len(shown)))
    times = np.atleast_2d(run.times)
    for axis, kind in zip(axes.flat, shown, strict=False):
        for i, name in enumerate(sorted(groups[kind])):
            number = name.rpartition("_")[2]
            part = "link" if kind in ("tip_deflection", "strain", "tip_acceleration") else "joint"
            label = number if kind == "tip" else f"{part} {number}"
            _curves(axis, times, run[name], label, f"C{i}", "-")
            if kind == "angle" and f"reference_{number}" in run.channels:
                _curves(axis, times, run[f"reference_{number}"], None, f"C{i}", "--")
        word = "tip position" if kind == "tip" else TITLES[kind]
        axis.set_ylabel(f"{word} [{unit(sorted(groups[kind])[0])}]")
        axis.legend(fontsize=8, frameon=False)
    for axis in list(axes.flat)[len(shown) :]:
        axis.remove()
    for axis in figure.axes[-2:]:
        axis.set_xlabel("time [s]")
        axis.tick_params(labelbottom=True)
    if title:
        figure.suptitle(title)
    return figure


def _curves(axis, times, values, label: str | None, colour: str, style: str) -> None:
    """One channel, a curve for every member of the batch, of which the first is named."""
    count = times.shape[-1]
    lines = np.broadcast_to(np.atleast_2d(values), times.shape).reshape(-1, count)
    width = 0.8 if style == "--" else 1.5 if len(lines) == 1 else 1.0
    for i, (t, line) in enumerate(zip(times.reshape(-1, count), lines, strict=True)):
        alpha = 1.0 if len(lines) == 1 else 0.4 + 0.6 * i / (len(lines) - 1)
        axis.plot(
            t,
            line,
            style,
            color=colour,
            linewidth=width,
            alpha=alpha,
            label=label if i == len(lines) - 1 else None,
        )
