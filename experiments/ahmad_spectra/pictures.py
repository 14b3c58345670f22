"""The picture: Fig. 4 and 5 of the paper, and Table III beside the exact frequencies."""

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from .paper import TABLE_III


def plot_spectra(f, density, grams, peaks, frequencies, radius) -> Figure:
    """Spectra by payload, and their peaks against payload with the paper's figures and the exact ones."""
    figure = Figure(figsize=(10.5, 7.0), layout="constrained")
    axes = figure.subplots(2, 2)
    shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.85, len(grams)))
    for link in (0, 1):
        left, right = axes[link]
        for i, (gram, shade) in enumerate(zip(grams, shades, strict=True)):
            left.semilogy(f[1:], density[i, link][1:], color=shade, linewidth=1.1, label=f"{gram} g")
        for i, height in ((0, 0.9), (len(grams) - 1, 0.76)):
            for peak in labelled(peaks[i][link], peaks[0][link] if i else []):
                left.axvline(peak, ymax=height, color=shades[i], linewidth=0.6, linestyle=":")
                left.annotate(f"{peak:.1f} Hz", (peak, height), xycoords=("data", "axes fraction"), ha="center",
                              xytext=(0, 2), textcoords="offset points", fontsize=8, rotation=90,
                              color=shades[i])  # fmt: skip
        left.set_xscale("log")
        left.set_xlim(1.0, f[-1])
        left.set_xticks([1, 2, 3, 5, 10, 20, 30, 40], ["1", "2", "3", "5", "10", "20", "30", "40"])
        left.xaxis.set_minor_formatter("")
        left.set_ylim(0.3 * density[:, link, 1:].min(), 1e4 * density[:, link].max())
        left.set_ylabel(f"tip acceleration of link {link + 1} [(m/s²)²/Hz]")
        bodies = {
            "exact": "exact, payload a point",
            "exact, payload with inertia": f"exact, radius {1000 * radius:.0f} mm",
        }
        for (name, label), style in zip(bodies.items(), ("-", ":"), strict=True):
            lines = right.semilogy(grams, frequencies[name], style, color="0.55", linewidth=1.3)
            lines[0].set_label(label)
        for i, gram in enumerate(grams):
            right.plot([gram] * len(peaks[i][link]), peaks[i][link], "o", color=shades[i], markersize=6,
                       fillstyle="none", label="peaks of the spectrum" if i == 0 else None)  # fmt: skip
            right.plot([gram] * 2, TABLE_III[gram][link], "x", color="#c44e52", markersize=6,
                       label="Table III" if i == 0 else None)  # fmt: skip
        right.set_yticks([2, 3, 5, 10, 20, 30], ["2", "3", "5", "10", "20", "30"])
        right.yaxis.set_minor_formatter("")
        right.set_ylabel(f"resonances of link {link + 1} [Hz]")
    axes[1, 0].set_xlabel("frequency [Hz]")
    axes[1, 1].set_xlabel("payload [g]")
    axes[0, 0].legend(title="payload", fontsize=7, title_fontsize=7, ncols=2, loc="lower left")
    axes[0, 1].legend(fontsize=8, frameon=False, loc="center")
    for axis in axes.flat:
        axis.grid(True, alpha=0.3, linewidth=0.5)
        axis.spines[["top", "right"]].set_visible(False)
    return figure


def labelled(peaks: list[float], others: list[float]) -> list[float]:
    """Those of `peaks` [Hz] that can be labelled beside each other and beside `others`."""
    chosen: list[float] = []
    for peak in peaks:
        if all(abs(np.log(peak / near)) > 0.04 for near in [*chosen, *others]):
            chosen.append(peak)
    return chosen
