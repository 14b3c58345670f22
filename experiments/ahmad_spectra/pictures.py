"""The picture: Fig. 4 and 5 of the paper, and Table III beside the exact frequencies."""

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from .paper import TABLE_III


def plot_spectra(f, density, grams, peaks, exact) -> Figure:
    """Spectra by payload, and their peaks against payload with the paper's figures and the exact ones."""
    figure = Figure(figsize=(10.5, 7.0), layout="constrained")
    axes = figure.subplots(2, 2)
    shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.85, len(grams)))
    for link in (0, 1):
        left, right = axes[link]
        for i, (gram, shade) in enumerate(zip(grams, shades, strict=True)):
            left.semilogy(f[1:], density[i, link][1:], color=shade, linewidth=1.1, label=f"{gram} g")
        for i, height in ((0, 0.86), (len(grams) - 1, 0.7)):
            for peak in labelled(peaks[i][link]):
                left.axvline(peak, ymax=height, color=shades[i], linewidth=0.6, linestyle=":")
                left.annotate(f"{peak:.1f} Hz", (peak, height), xycoords=("data", "axes fraction"), ha="center",
                              xytext=(0, 2), textcoords="offset points", fontsize=8, rotation=90,
                              color=shades[i])  # fmt: skip
        left.set_xscale("log")
        left.set_xlim(1.0, f[-1])
        left.set_xticks([1, 2, 3, 5, 10, 20, 30, 40], ["1", "2", "3", "5", "10", "20", "30", "40"])
        left.xaxis.set_minor_formatter("")
        left.margins(y=0.4)
        left.set_ylabel(f"tip acceleration of link {link + 1} [(m/s²)²/Hz]")
        for j in range(exact.shape[1]):
            right.semilogy(grams, exact[:, j], color="0.6", linewidth=1.2, label="exact" if j == 0 else None)
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
    axes[0, 0].legend(title="payload", fontsize=7, title_fontsize=7, frameon=False, ncols=2, loc="lower left")
    axes[0, 1].legend(fontsize=8, frameon=False, loc="center")
    for axis in axes.flat:
        axis.grid(True, alpha=0.3, linewidth=0.5)
        axis.spines[["top", "right"]].set_visible(False)
    return figure


def labelled(peaks: list[float]) -> list[float]:
    """Those of ascending `peaks` [Hz] that can be labelled side by side."""
    chosen: list[float] = []
    for peak in peaks:
        if not chosen or peak > 1.08 * chosen[-1]:
            chosen.append(peak)
    return chosen
