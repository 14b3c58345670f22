"""The pictures of the slewing experiment."""

import numpy as np
from matplotlib.figure import Figure

from ..pictures import MEASURED, OURS, THEIRS, figure
from .slew import AFTER, Slew


def slewing(found: Slew) -> Figure:
    """Current, hub angle and tip deflection of every model (Fig. 8 to 10)."""
    made, ((current, angle), (left, right)) = figure(2, 2, height=2.8, width=12.0)
    t = found.times
    current.plot(t, found.current, color=OURS)
    current.set_ylabel("motor current [A]")
    current.set_title("a current like Fig. 8", fontsize=10)
    for name, colour in (("encoder", "0.6"), ("coupled", OURS), ("lumped", THEIRS), ("one-way", MEASURED)):
        angle.plot(t, found.angle[name], color=colour, label=name, linewidth=3 if name == "encoder" else 1)
    angle.set_ylabel("hub angle [rad]")
    angle.set_title("hub angle (Fig. 9)", fontsize=10)
    left.plot(t, 1e3 * found.tip["strain gauge"], color="0.6", label="from the strain gauge", linewidth=0.8)
    left.plot(t, 1e3 * found.tip["coupled"], color=OURS, label="coupled")
    left.plot(t, 1e3 * found.tip["lumped"], color=THEIRS, label="lumped", linewidth=0.9)
    left.set_title("tip deflection (Fig. 10)", fontsize=10)
    right.plot(t, 1e3 * found.tip["one-way"], color=MEASURED, label="one-way (12)", linewidth=0.9)
    right.plot(t, 1e3 * found.tip["coupled"], color=OURS, label="coupled")
    right.plot(
        t, 1e3 * found.tip["one-way, measured hub"], ":", color="k",
        label="one-way (11), hub as measured", linewidth=1,
    )  # fmt: skip
    right.set_title("tip deflection, the one-way model", fontsize=10)
    for axis in (left, right):
        axis.set_ylabel("tip deflection [mm]")
        axis.set_xlabel("time [s]")
    for axis in (current, angle, left, right):
        axis.set_xlim(0, AFTER + 0.5)
    for axis in (angle, left, right):
        axis.legend(fontsize=8, frameon=False, loc="lower right" if axis is angle else "upper right")
    low, high = right.get_ylim()
    for axis in (left, right):
        axis.set_ylim(low, high + 0.35 * (high - low))
    return made


def tops(frequencies: np.ndarray, size: np.ndarray) -> list[int]:
    """Indices of the resonances: local maxima a third higher than all that is 8 Hz away."""
    away = round(8.0 / (frequencies[1] - frequencies[0]))
    padded = np.pad(size, away)
    beside = np.maximum(padded[: -2 * away], padded[2 * away :])
    local = (size[1:-1] > size[:-2]) & (size[1:-1] > size[2:])
    return [int(i) + 1 for i in np.flatnonzero(local) if size[i + 1] > 1.33 * beside[i + 1]]


def transfer(
    frequencies: np.ndarray, gains: dict[str, np.ndarray], times: np.ndarray, steps: dict[str, np.ndarray]
) -> Figure:
    """(12) in frequency, and its inverse transform beside the coupled model's step response."""
    made, ((left, right),) = figure(1, 2, height=3.8, width=12.0)
    colours = dict(zip(gains, ("0.6", MEASURED, OURS), strict=True))
    for name, gain in gains.items():
        size = 1e3 * np.abs(gain)
        left.semilogy(frequencies, size, color=colours[name], label=name)
        if name == next(iter(gains)):  # it peaks where its neighbour does
            continue
        for top in tops(frequencies, size):
            left.annotate(
                f"{frequencies[top]:.1f} Hz", (frequencies[top], size[top]), xytext=(0, 4), ha="center",
                textcoords="offset points", fontsize=8, color=colours[name],
                bbox=dict(facecolor="white", edgecolor="none", alpha=0.85, pad=0.3),
            )  # fmt: skip
    left.set_xlabel("frequency [Hz]")
    left.set_ylabel("tip deflection / voltage [mm/V]")
    left.margins(y=0.15)
    left.legend(fontsize=8, frameon=False, loc="upper right")
    closed, simulated, beam = steps["closed form"], steps["one-way"], steps["coupled"]
    right.plot(times, 1e3 * closed, color=MEASURED, label="(12), inverse transform in closed form")
    right.plot(times[::30], 1e3 * simulated[::30], ".", color="k", markersize=4, label="(9) integrated")
    right.plot(times, 1e3 * beam, color=OURS, label="coupled")
    right.set_xlabel("time after a step of 1 V [s]")
    right.set_ylabel("tip deflection [mm]")
    right.legend(fontsize=8, frameon=False, loc="upper right")
    low, high = right.get_ylim()
    right.set_ylim(low, high + 0.3 * (high - low))
    return made


def locus(
    by_damping: tuple[np.ndarray, np.ndarray],
    by_stiffness: tuple[np.ndarray, np.ndarray],
    titles: tuple[str, str],
    clamped: np.ndarray,
    times: np.ndarray,
    runs: dict[float, tuple[np.ndarray, np.ndarray]],
) -> Figure:
    """Root locus against both gains, and the tip during a move under three damping gains."""
    made, axes = figure(2, 2, height=3.6, width=12.0)
    labels = ("damping gain [V s/rad]", "stiffness gain [V/rad]")
    for axis, (gains, swept), title, label in zip(
        axes[0], (by_damping, by_stiffness), titles, labels, strict=True
    ):
        across = np.broadcast_to(gains[:, None], swept.shape)
        shown = (swept.imag >= 0) & (swept.real > -260)
        points = axis.scatter(
            swept.real[shown], swept.imag[shown] / (2 * np.pi), c=np.log10(across[shown]), s=7, cmap="viridis"
        )
        bar = made.colorbar(points, ax=axis, shrink=0.9)
        ticks = np.arange(np.ceil(np.log10(gains[0])), np.floor(np.log10(gains[-1])) + 1)
        bar.set_ticks(ticks, labels=[f"{10.0**tick:g}" for tick in ticks])
        bar.set_label(label)
        axis.plot(np.zeros_like(clamped), clamped, "x", color=MEASURED, label="clamped link (one-way): stays")
        axis.set_xlim(-260, 8)
        axis.set_ylim(-3, 155)
        axis.set_title(title, fontsize=10)
        axis.set_xlabel("real part [1/s]")
        axis.set_ylabel("imaginary part / 2π [Hz]")
    axes[0, 0].legend(fontsize=8, frameon=False, loc="center left", bbox_to_anchor=(0.0, 0.45))
    for axis, which, title in zip(axes[1], (0, 1), ("coupled", "one-way"), strict=True):
        for (gain, tips), colour in zip(runs.items(), (THEIRS, OURS, MEASURED), strict=True):
            axis.plot(times, 1e3 * tips[which], color=colour, linewidth=1, label=f"{gain:.2g} V s/rad")
        axis.set_title(f"tip in a move of 0.5 rad in 0.25 s, {title}", fontsize=10)
        axis.set_xlabel("time [s]")
        axis.set_ylabel("tip deflection [mm]")
        axis.set_xlim(0, 1.2)
        axis.legend(fontsize=8, frameon=False, title="damping gain", title_fontsize=8, loc="upper right")
    return made
