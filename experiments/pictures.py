"""The look that the experiments' pictures share."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

MEASURED, OURS, THEIRS = "#c44e52", "#2a6f97", "#dd8452"


def figure(rows: int, columns: int, height: float = 3.2, width: float = 10.0) -> tuple[Figure, np.ndarray]:
    """A figure of `rows` by `columns` axes, each row `height` inches high."""
    made = Figure(figsize=(width, height * rows), layout="constrained")
    axes = made.subplots(rows, columns, squeeze=False)
    for axis in axes.flat:
        axis.grid(True, alpha=0.3, linewidth=0.5)
        axis.spines[["top", "right"]].set_visible(False)
    return made, axes


def level(
    axis: Axes, value: float, label: str, colour: str = MEASURED, at: float = 0.01, below: bool = False
) -> None:
    """A horizontal line at `value` with its label on it or `below` it, `at` a share of the axis' width."""
    axis.axhline(value, color=colour, linewidth=0.9, linestyle="--")
    axis.annotate(
        label, (at, value), xycoords=("axes fraction", "data"), xytext=(0, -9 if below else 2),
        textcoords="offset points", fontsize=7, color=colour,
    )  # fmt: skip
