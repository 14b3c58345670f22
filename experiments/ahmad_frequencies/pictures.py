"""The pictures of the study."""

import numpy as np
from matplotlib.figure import Figure


def _figure(rows: int, columns: int, size):
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False)
    for axis in axes.flat:
        axis.grid(True, which="both", alpha=0.25, linewidth=0.5)
        axis.spines[["top", "right"]].set_visible(False)
    return figure, axes


def plot_effects(payloads, bends, found) -> Figure:
    """Frequencies over payload and over pose, the modal model as lines and finite elements as marks."""
    figure, axes = _figure(2, 2, (9.5, 7.0))
    sweeps = {
        "payload": (1e3 * payloads, "payload [g], arm stretched"),
        "pose": (np.rad2deg(bends), "angle of the second joint [deg], 50 g"),
    }
    for row, (sweep, (x, label)) in zip(axes, sweeps.items(), strict=True):
        for axis, (held, pair) in zip(row, found[sweep].items(), strict=True):
            for j in range(pair["modal"].shape[1]):
                axis.semilogy(
                    x, pair["modal"][:, j], color=f"C{j}", label="modal, 2 modes a link" if j == 0 else None
                )
                axis.semilogy(x, pair["exact"][:, j], "o", color=f"C{j}", markersize=4, fillstyle="none",
                              label="finite elements" if j == 0 else None)  # fmt: skip
                low_above = j == 2 and abs(pair["exact"][-1, 3] / pair["exact"][-1, 2] - 1) < 0.15
                axis.annotate(f"{pair['exact'][-1, j]:.3g} Hz", (x[-1], pair["exact"][-1, j]),
                              xytext=(6, -9 if low_above else -2), textcoords="offset points", fontsize=8,
                              color=f"C{j}")  # fmt: skip
            axis.set_xlabel(label)
            axis.set_title(held, fontsize=10)
            axis.margins(x=0.14)
            axis.yaxis.set_major_formatter("{x:g}")
            axis.yaxis.set_minor_formatter("")
        row[0].set_ylabel("natural frequency [Hz]")
    axes[0, 0].legend(frameon=False, fontsize=8, loc="center")
    return figure


def plot_convergence(counts, errors) -> Figure:
    """Worst error of four frequencies against the number of modes, by shapes."""
    figure, axes = _figure(1, 2, (10.0, 4.0))
    for axis, (held, table) in zip(axes[0], errors.items(), strict=True):
        for j, (kind, values) in enumerate(table.items()):
            axis.semilogy(counts, values, "os^vDx"[j % 6] + "-", color=f"C{j}", markersize=5,
                          linewidth=2.2 if j == 0 else 1.1, label=kind)  # fmt: skip
        axis.axhline(1.0, color="0.5", linewidth=0.8)
        axis.set_xticks(counts)
        axis.set_xlabel("mode shapes a link")
        axis.set_title(held, fontsize=10)
        axis.yaxis.set_major_formatter("{x:g}")
    axes[0, 0].set_ylabel("worst error of four frequencies [%]")
    axes[0, 1].legend(frameon=False, fontsize=8)
    return figure
