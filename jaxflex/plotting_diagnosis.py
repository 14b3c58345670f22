"""Pictures of a diagnosis: the gap, the predictions, and the force that is missing."""

from collections.abc import Callable
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from scipy.signal import find_peaks

from .analysis.measures import spectrum
from .diagnosis.locate import LatentForce
from .diagnosis.result import Comparison, Gap
from .plotting import AFTER, BEFORE, TITLES, WIDTH, panels
from .sensors import unit

BINS = 30
FEWEST = 4  # points that a bin's median is drawn from
BAND = (16, 50, 84)  # per cent: what is drawn of a bin, which a few wild estimates do not move
TAILS = (0.5, 99.5)  # per cent of the moments: what lies outside is left out of a picture
WILD = (3.0, 97.0)  # the same of the forces, of which an estimate has some that are far off
MOST = 2.0  # heights of the force before that the one after may add to its picture
SMOOTHED = 5  # neighbours that a spectrum is averaged over
PROMINENCE = 1.0  # decades that a peak stands above both of its sides
POINTS = 1500  # drawn of a cloud


@dataclass(frozen=True)
class View:
    """What a force is drawn against, and what shapes mean there."""

    axis: str
    quantity: Callable[[LatentForce], np.ndarray]
    shapes: str


VIEWS = {
    "speed": View(
        "joint rate [rad/s]",
        lambda force: force.rate,
        "A step at zero is Coulomb friction; a straight line, viscous friction; a hump beside zero that fades "
        "with speed, Stribeck friction.",
    ),
    "angle": View(
        "joint angle [rad]",
        lambda force: force.angle,
        "A straight line is a spring, such as a cable; part of one slow wave, gravity; many waves, cogging.",
    ),
    "acceleration": View(
        "joint acceleration [rad/s²]",
        lambda force: force.acceleration,
        "A straight line is an inertia or a mass that is not as the file says.",
    ),
    "speed_squared": View(
        "joint rate times its size [rad²/s²]",
        lambda force: force.rate * np.abs(force.rate),
        "A straight line is drag that grows with the square of speed.",
    ),
    "time": View(
        "time [s]",
        lambda force: force.times,
        "A level away from zero is a steady load; a slope, something that warms up or drifts; a wave that does "
        "not care for the motion, a disturbance from outside.",
    ),
}
SPECTRUM = (
    "A narrow peak away from the frequencies of the motion is a periodic disturbance; one at a natural "
    "frequency of the arm, a mass, stiffness or damping that is not as the file says."
)


def title(channel: str) -> str:
    """`angle_1` as `joint angle 1`."""
    kind, _, count = channel.rpartition("_")
    return TITLES.get(channel) or f"{TITLES[kind]} {count}"


def plot_gap(gap: Gap) -> Figure:
    """Error of every channel before and after, as multiples of its noise floor, on a logarithmic scale."""
    channels = [name for name, floor in gap.noise_floor.items() if floor > 0]
    figure, axes = panels(1, 1, height=1.0 + 0.62 * len(channels), width=WIDTH)
    axis = axes[0, 0]
    rows = np.arange(len(channels))
    largest = 1.0
    for offset, errors, colour, label in (
        (-0.19, gap.before, BEFORE, "before"),
        (0.19, gap.after, AFTER, "after"),
    ):
        ratios = np.array([errors[name] / gap.noise_floor[name] for name in channels])
        largest = max(largest, *ratios)
        axis.barh(rows + offset, ratios, 0.34, color=colour, label=label, zorder=2)
        for row, ratio, name in zip(rows, ratios, channels, strict=True):
            axis.annotate(
                f"{errors[name]:.3g} {unit(name)}".removesuffix(" 1"), (max(ratio, 1.0), row + offset),
                xytext=(4, 0), textcoords="offset points", va="center", fontsize=8,
            )  # fmt: skip
    axis.axvline(1.0, color="0.25", linestyle="--", linewidth=1, label="noise floor")
    axis.set_xscale("log")
    axis.set_xlim(0.5, largest * max(largest, 3.0) ** 0.45 * 1.3)
    axis.xaxis.set_major_formatter("{x:g}")
    axis.set_yticks(rows, [title(name) for name in channels])
    axis.invert_yaxis()
    axis.grid(False, axis="y")
    axis.set_xlabel("error on held-out data / noise floor [1]" if gap.held_out else "error / noise floor [1]")
    figure.legend(fontsize=8, frameon=False, loc="outside upper right", ncols=3)
    return figure


def plot_prediction(comparison: Comparison, channel: str, floor: float) -> Figure:
    """A channel as measured and as predicted before and after, over its errors and the noise floor."""
    figure, axes = panels(2, 1, height=2.0, width=WIDTH)
    above, below = axes[:, 0]
    times, measured = comparison.times, comparison.measured[channel]
    above.plot(times, measured, color="0.15", linewidth=1.6, label="measured")
    for predicted, colour, style, label in (
        (comparison.before[channel], BEFORE, "-", "before"),
        (comparison.after[channel], AFTER, "--", "after"),
    ):
        above.plot(times, predicted, style, color=colour, linewidth=0.9, label=label)
        below.plot(times, measured - predicted, color=colour, linewidth=0.7)
    for side in (-2, 2):
        label = "noise floor, ±2 std" if side > 0 else None
        below.axhline(side * floor, color="0.1", linestyle=":", linewidth=1.4, label=label, zorder=4)
    above.set_ylabel(f"{title(channel)} [{unit(channel)}]")
    below.set_ylabel(f"error [{unit(channel)}]")
    below.set_xlabel("time [s]")
    figure.legend(fontsize=8, frameon=False, loc="outside upper right", ncols=4)
    below.ticklabel_format(axis="y", scilimits=(-2, 4), useMathText=True)
    figure.align_ylabels()
    return figure


def plot_force(view: View, before: LatentForce, after: LatentForce) -> Figure:
    """The missing force before and after against one quantity: points, binned median and band of two thirds."""
    figure, axes = panels(1, 1, height=3.1, width=WIDTH)
    axis = axes[0, 0]
    x = [view.quantity(force) for force in (before, after)]
    edges = np.linspace(*_spread(np.concatenate(x), TAILS), BINS + 1)
    for place, force, colour, label in zip(
        x, (before, after), (BEFORE, AFTER), ("before", "after"), strict=True
    ):
        _cloud(axis, place, force.values, edges, colour, label)
    axis.set_xlim(edges[0], edges[-1])
    low, high = _spread(before.values, WILD)
    lowest, highest = _spread(after.values, WILD)
    room = MOST * (high - low)  # an estimate that ran away must not hide the other
    axis.set_ylim(max(min(low, lowest), low - room), min(max(high, highest), high + room))
    axis.axhline(0.0, color="0.4", linewidth=0.6)
    axis.ticklabel_format(axis="y", scilimits=(-2, 4), useMathText=True)
    axis.set_xlabel(view.axis)
    axis.set_ylabel(_force_label(before))
    figure.legend(fontsize=8, frameon=False, loc="outside upper right", ncols=2)
    return figure


def plot_force_spectrum(before: LatentForce, after: LatentForce) -> Figure:
    """Spectral density of the missing force before and after, with Hz on the peaks."""
    figure, axes = panels(1, 1, height=3.1, width=WIDTH)
    axis = axes[0, 0]
    labelled: list[float] = []
    for force, colour, label in ((before, BEFORE, "before"), (after, AFTER, "after")):
        times = np.linspace(force.times[0], force.times[-1], len(force.times))
        f, density = map(np.asarray, spectrum(jnp.asarray(times), jnp.asarray(force.values)))
        f, density = f[1:], density[1:]
        smooth = np.convolve(density, np.full(SMOOTHED, 1 / SMOOTHED), "same")
        if not np.all(smooth > 0):
            continue
        axis.semilogy(f, smooth, color=colour, linewidth=1.0, label=label)
        # padded, so that a peak at the lowest frequencies has a foot on either side
        level = np.pad(np.log10(smooth), 1, constant_values=np.log10(smooth.min()))
        peaks, found = find_peaks(level, prominence=PROMINENCE)
        for peak in (peaks - 1)[np.argsort(-found["prominences"])][:3]:
            near = slice(max(peak - SMOOTHED // 2, 0), peak + SMOOTHED // 2 + 1)
            line = float(f[near][np.argmax(density[near])])
            if any(abs(line - other) < 0.13 * f[-1] for other in labelled):
                continue
            labelled.append(line)
            axis.annotate(
                f"{line:.1f} Hz", (line, smooth[peak]), xytext=(0, 5),
                textcoords="offset points", ha="center", fontsize=8, color=colour,
                path_effects=[withStroke(linewidth=3, foreground="white")], zorder=5,
            )  # fmt: skip
    axis.set_xlabel("frequency [Hz]")
    axis.set_ylabel(f"density [({before.unit})²/Hz]")
    axis.margins(y=0.12)
    figure.legend(fontsize=8, frameon=False, loc="outside upper right", ncols=2)
    return figure


def _force_label(force: LatentForce) -> str:
    kind = {"N m": "torque", "V": "voltage", "N": "force"}[force.unit]
    return f"{kind} that is missing [{force.unit}]"


def _spread(values: np.ndarray, tails: tuple[float, float]) -> tuple[float, float]:
    """Limits that show all but the tails, with a margin."""
    low, high = np.percentile(values[np.isfinite(values)], tails)
    margin = 0.08 * (high - low) or 1.0
    return low - margin, high + margin


def _cloud(axis: Axes, x: np.ndarray, y: np.ndarray, edges: np.ndarray, colour: str, label: str) -> None:
    step = max(1, len(x) // POINTS)
    axis.plot(x[::step], y[::step], ".", color=colour, markersize=2, alpha=0.3, zorder=1)
    place = np.searchsorted(edges, x, side="right") - 1
    bins = [y[place == b] for b in range(BINS)]
    nothing = np.full(3, np.nan)
    low, median, high = np.array([np.percentile(b, BAND) if len(b) >= FEWEST else nothing for b in bins]).T
    middle = (edges[:-1] + edges[1:]) / 2
    axis.fill_between(middle, low, high, color=colour, alpha=0.2, linewidth=0, zorder=2)
    axis.plot(middle, median, color=colour, linewidth=2, label=label, zorder=3)
