"""Every picture the library draws; each function returns a matplotlib Figure."""

from collections.abc import Mapping, Sequence
from io import BytesIO

import matplotlib
import numpy as np
from matplotlib.figure import Figure

TITLES = {
    "angle": "joint angle",
    "rate": "joint rate",
    "voltage": "motor voltage",
    "current": "motor current",
    "torque": "motor torque",
    "tip_deflection": "tip deflection",
    "tip_acceleration": "tip acceleration",
    "strain": "strain",
    "reference": "reference",
    "tip_x": "tip position x",
    "tip_y": "tip position y",
}
BEFORE, AFTER = "#c44e52", "#2a6f97"
WIDTH = 5.0  # inches: legible across a telephone, two side by side across a desk


class Picture(Figure):
    """A figure that notebooks show without pyplot, and so without its list of open figures."""

    def _repr_png_(self) -> bytes:
        stream = BytesIO()
        self.savefig(stream, format="png", dpi=96)
        return stream.getvalue()


def panels(rows: int, columns: int, height: float = 2.6, width: float = 9.0):
    """An empty figure of panels that share their time or frequency axis; sizes in inches."""
    figure = Picture(figsize=(width, height * rows), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, sharex=True)
    for axis in axes.flat:
        axis.grid(True, alpha=0.3, linewidth=0.5)
        axis.spines[["top", "right"]].set_visible(False)
    return figure, axes


def _shades(count: int):
    return matplotlib.colormaps["viridis"](np.linspace(0.0, 0.85, max(count, 1)))


def plot_bending(
    times: np.ndarray, bends: np.ndarray, end: float, payloads: Sequence[float], top: float
) -> Figure:
    """Tip deflection of every link for every payload, up to `top` [m] either way.

    `bends`: `(payloads, times, links)` [m]; `end` [s] of the commanded move.
    """
    links = bends.shape[-1]
    figure, axes = panels(links, 1, height=2.8 if links == 1 else 2.2, width=WIDTH)
    for link, axis in enumerate(axes[:, 0]):
        for run, payload, shade in zip(bends, payloads, _shades(len(payloads)), strict=True):
            axis.plot(times, 1e3 * run[:, link], color=shade, label=f"{1e3 * payload:.0f} g", linewidth=1)
        axis.axvline(end, color="0.4", linestyle=":", linewidth=1)
        axis.annotate(
            "end of move", (end, 0.0), xycoords=("data", "axes fraction"),
            xytext=(3, 4), textcoords="offset points", fontsize=8, color="0.3",
        )  # fmt: skip
        axis.set_ylim(-1e3 * top, 1e3 * top)
        axis.set_ylabel(f"tip deflection{f', link {link + 1}' if links > 1 else ''} [mm]")
    axes[-1, 0].set_xlabel("time [s]")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, fontsize=8, frameon=False, loc="outside upper right", ncols=4)
    return figure


def plot_residual(
    payloads: np.ndarray, residual: Mapping[str, np.ndarray], tuned: str, tuned_on: Sequence[float]
) -> Figure:
    """Residual vibration [m] against payload [kg] for every design, the tuning payloads marked."""
    figure, axes = panels(1, 1, height=5.0, width=WIDTH)
    axis = axes[0, 0]
    for i, (name, values) in enumerate(residual.items()):
        best = name == tuned
        style = (
            dict(color=AFTER, linewidth=2.6, zorder=5) if best else dict(color=f"C{i % 10}", linewidth=1.1)
        )
        if "tuned PD" in name:
            style["linestyle"] = "--"
        axis.semilogy(1e3 * payloads, 1e3 * values, label=name, **style)
        if best:
            marked = np.interp(np.asarray(tuned_on), payloads, values)
            axis.semilogy(
                1e3 * np.asarray(tuned_on), 1e3 * marked, "o", color=AFTER, zorder=6, label="tuned on"
            )
    axis.set_xlabel("payload [g]")
    axis.set_ylabel("residual tip vibration, peak to peak [mm]")
    axis.grid(True, which="both", alpha=0.25, linewidth=0.5)
    figure.legend(fontsize=8, frameon=False, loc="outside lower center", ncols=3)
    return figure


def plot_spectra(
    frequencies: np.ndarray,
    before: np.ndarray,
    after: np.ndarray,
    labels: tuple[str, str],
    quantity: str,
    top: float,
) -> Figure:
    """Spectral densities before and after, worst payload of each, with Hz on their peaks.

    `before`, `after`: `(payloads, frequencies)`; shown up to `top` [Hz].
    """
    figure, axes = panels(1, 1, height=3.8, width=WIDTH)
    axis = axes[0, 0]
    shown = (frequencies > 0) & (frequencies <= top)
    f = frequencies[shown]
    for spectra, colour, label in zip((before, after), (BEFORE, AFTER), labels, strict=True):
        density = np.max(spectra, axis=0)[shown]
        axis.semilogy(f, density, color=colour, label=label)
        for peak in strongest_peaks(f, density, 4):
            axis.plot(f[peak], density[peak], "v", color=colour, markersize=4)
            axis.annotate(
                f"{f[peak]:.2f} Hz", (f[peak], density[peak]), xytext=(0, 6),
                textcoords="offset points", ha="center", fontsize=8, color=colour,
            )  # fmt: skip
    axis.set_xlabel("frequency [Hz]")
    axis.set_ylabel(quantity)
    axis.margins(y=0.12)
    axis.legend(frameon=False, fontsize=8)
    return figure


def strongest_peaks(f: np.ndarray, density: np.ndarray, count: int) -> list[int]:
    """Indices of the `count` highest local maxima, 3 dB above their surroundings and apart from each other."""
    inside = (density[1:-1] > density[:-2]) & (density[1:-1] >= density[2:])
    peaks = []
    for i in np.flatnonzero(inside) + 1:
        window = density[max(0, i - 6) : i + 7]
        if density[i] > 2 * np.median(window):
            peaks.append(int(i))
    apart = 0.04 * (f[-1] - f[0])  # closer ones could not be labelled side by side
    chosen: list[int] = []
    for i in sorted(peaks, key=lambda i: -density[i]):
        if all(abs(f[i] - f[j]) > apart for j in chosen):
            chosen.append(i)
    return chosen[:count]


def plot_modes(payloads: np.ndarray, families: Mapping[str, np.ndarray]) -> Figure:
    """Natural frequencies [Hz] against payload [kg]; `families`: title to `(payloads, modes)`."""
    figure, axes = panels(1, len(families), height=3.8)
    for axis, (title, values) in zip(axes[0], families.items(), strict=True):
        for j in range(values.shape[1]):
            if np.all(values[:, j] <= 0):
                continue  # a rigid-body zero has no place on a logarithmic scale
            axis.semilogy(1e3 * payloads, values[:, j], "o-", markersize=3, color=f"C{j % 10}")
            axis.annotate(
                f"{values[-1, j]:.3g} Hz", (1e3 * payloads[-1], values[-1, j]), xytext=(4, -3),
                textcoords="offset points", fontsize=7, color=f"C{j % 10}",
            )  # fmt: skip
        axis.set_title(title, fontsize=10)
        axis.set_xlabel("payload [g]")
        axis.margins(x=0.3, y=0.08)
        axis.yaxis.set_major_formatter("{x:g}")
        axis.yaxis.set_minor_formatter("{x:g}")
        axis.tick_params(which="both", labelsize=8)
    axes[0, 0].set_ylabel("natural frequency [Hz]")
    return figure


def plot_history(histories: Sequence[Sequence[float]]) -> Figure:
    """Cost of the best design so far against the step, for every descent."""
    figure, axes = panels(1, 1, height=2.6, width=WIDTH)
    for number, history in enumerate(histories, 1):
        axes[0, 0].plot(np.arange(1, len(history) + 1), history, label=f"descent {number}")
    axes[0, 0].set_xlabel("step [1]")
    axes[0, 0].set_ylabel("cost (logarithmic) [1]")
    axes[0, 0].legend(frameon=False, fontsize=8)
    return figure


def plot_pareto(
    move_times: np.ndarray,
    residual: np.ndarray,
    efficient: np.ndarray,
    others: Mapping[str, np.ndarray] | None = None,
) -> Figure:
    """Worst residual vibration [m] against move time [s]: the front, and `others` at the same move times.

    Points that a shorter move matches are drawn hollow; NaN where a design is impossible in so short a time.
    """
    figure, axes = panels(1, 1, height=4.2, width=8.0)
    axis = axes[0, 0]
    for i, (name, values) in enumerate((others or {}).items()):
        axis.semilogy(
            move_times, 1e3 * values, "--", color=f"C{i + 1}", linewidth=1.1, marker=".", label=name
        )
    axis.semilogy(move_times, 1e3 * residual, color=AFTER, linewidth=2.2, label="tuned for each move time")
    for kept, fill in ((efficient, AFTER), (~efficient, "white")):
        axis.semilogy(
            move_times[kept], 1e3 * residual[kept], "o", color=AFTER, markerfacecolor=fill, linestyle="none"
        )
    axis.set_xlabel("move time, shaper included [s]")
    axis.set_ylabel("worst residual tip vibration, peak to peak [mm]")
    axis.grid(True, which="both", alpha=0.25, linewidth=0.5)
    axis.legend(frameon=False, fontsize=8)
    return figure
