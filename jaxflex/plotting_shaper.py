"""The picture of `jaxflex shaper`: what rings, and what each shaper leaves of it."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from scipy.signal import find_peaks

from .plotting import AFTER, panels

LABELS = 4  # peaks that are written on


def plot_shapers(
    frequencies: np.ndarray,
    spectrum: np.ndarray,
    bands: Sequence[tuple[float, float]],
    curves: Mapping[str, np.ndarray],
    recommended: str,
    coloured: Sequence[str],
) -> Figure:
    """Spectrum over frequency [Hz], the spread of each mode, and the share that every shaper leaves.

    `spectrum` in any unit, drawn as a share of its highest; `curves`: name of a shaper to
    its residual at `frequencies`; those `coloured` stand out from the rest.
    """
    figure, axes = panels(1, 1, height=4.6)
    axis = axes[0, 0]
    share = spectrum / spectrum.max()
    axis.fill_between(frequencies, 0, share, color="0.82", label="spectrum (left scale)", zorder=1)
    axis.plot(frequencies, share, color="0.55", linewidth=0.8, zorder=1)
    for i, (low, high) in enumerate(bands):
        wide = max(high - low, 2e-3 * frequencies[-1])
        middle = (low + high) / 2
        axis.axvspan(
            middle - wide / 2, middle + wide / 2, color="#d09a2a", alpha=0.25, linewidth=0,
            label="spread of the modes" if i == 0 else None, zorder=0,
        )  # fmt: skip
    apart = len(frequencies) // 25  # closer ones could not be labelled side by side
    peaks = find_peaks(share, prominence=0.03, distance=apart)[0]
    for peak in peaks[np.argsort(-share[peaks])][:LABELS]:
        axis.annotate(
            f"{frequencies[peak]:.3g} Hz", (frequencies[peak], share[peak]), xytext=(0, 4), ha="center",
            textcoords="offset points", fontsize=9, weight="bold", color="0.25", zorder=6,
        )  # fmt: skip
    axis.set_xlabel("frequency [Hz]")
    axis.set_ylabel("spectrum, share of its highest [1]")
    axis.set_xlim(0, frequencies[-1])
    axis.set_ylim(0, 1.12)
    other = axis.twinx()
    other.spines[["top"]].set_visible(False)
    plain = True
    for name, curve in curves.items():
        if name not in coloured and name != recommended:
            label = "other shapers" if plain else None
            other.plot(frequencies, 100 * curve, color="0.72", linewidth=0.6, label=label, zorder=2)
            plain = False
    for i, name in enumerate(n for n in curves if n in coloured and n != recommended):
        other.plot(
            frequencies, 100 * curves[name], label=name, color=f"C{i + 1}", linewidth=1.3,
            linestyle=("--", "-.", ":")[i % 3], zorder=3,
        )  # fmt: skip
    best = f"{recommended} (recommended)"
    other.plot(frequencies, 100 * curves[recommended], label=best, color=AFTER, linewidth=2.6, zorder=5)
    other.set_ylim(0, 112)
    other.set_ylabel("vibration left by the shaper [%]")
    handles, labels = axis.get_legend_handles_labels()
    more, names = other.get_legend_handles_labels()
    axis.legend(
        handles + more,
        labels + names,
        fontsize=8,
        frameon=False,
        loc="upper left",
        bbox_to_anchor=(1.09, 1.0),
    )
    return figure
