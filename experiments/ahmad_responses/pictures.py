"""The pictures: Fig. 2 and 3 of the paper, and Table II."""

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from experiments.pictures import figure as new_figure

from .paper import COLUMNS, PAYLOADS, TABLE_II


def plot_responses(payloads, cases: dict[str, np.ndarray]) -> Figure:
    """Both joint angles over time for every payload; `cases`: `(payloads, joints, times)` [rad]."""
    figure, axes = new_figure(2, len(cases), 2.8, 11.0)
    shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.85, len(payloads)))
    for column, (title, curves) in enumerate(cases.items()):
        times = np.linspace(0.0, 5.0, curves.shape[-1])
        for joint in range(2):
            axis = axes[joint, column]
            for curve, payload, shade in zip(curves, payloads, shades, strict=True):
                axis.plot(times, curve[joint], color=shade, linewidth=1.2, label=f"{1000 * payload:.0f} g")
            axis.axvline(2.0, color="0.5", linewidth=0.8, linestyle=":")
            axis.set_ylabel(f"angle of joint {joint + 1} [rad]")
        axes[0, column].set_title(title, fontsize=10)
        axes[1, column].set_xlabel("time [s]")
    axes[1, 0].legend(title="payload", fontsize=7, title_fontsize=7, frameon=False, ncols=2)
    return figure


def plot_table(payloads, tables: dict[str, np.ndarray]) -> Figure:
    """Table II: the paper's figures and ours against payload."""
    figure, axes = new_figure(2, 3, 2.8, 11.0)
    for joint in range(2):
        for column in range(3):
            axis = axes[joint, column]
            paper = [row[column] for row in TABLE_II[joint]]
            axis.plot(1e3 * np.array(PAYLOADS), paper, "ko", markersize=5, label="Table II")
            for i, (name, table) in enumerate(tables.items()):
                axis.plot(1e3 * np.array(payloads), table[joint, :, column], ".-", color=f"C{i}", linewidth=1.1,
                          label=name)  # fmt: skip
            if column == 2:
                axis.set_yscale("symlog", linthresh=1.0)
                axis.yaxis.set_major_formatter("{x:g}")
            axis.set_ylabel(COLUMNS[column])
            axis.set_title(f"joint {joint + 1}", fontsize=10)
    for axis in axes[1]:
        axis.set_xlabel("payload [g]")
    axes[0, 0].legend(fontsize=7, frameon=False)
    return figure
