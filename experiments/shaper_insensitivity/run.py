"""Insensitivity curves of every shaper, beside the widths that their papers print."""

from pathlib import Path

import jax.numpy as jnp
import numpy as np

import controllers as ctl

from ..pictures import figure

PUBLISHED = {"ZV": 0.06, "ZVD": 0.29, "ZVDD": 0.48, "EI": 0.40, "EI, 2 humps": 0.73, "EI, 3 humps": 0.95}
DAMPING = 0.1
GROUPS = {
    "zero vibration and derivatives": ("ZV", "ZVD", "ZVDD"),
    "extra-insensitive": ("EI", "EI, 2 humps", "EI, 3 humps"),
    "unity magnitude": ("UM-ZV", "UM-ZVD"),
    "smooth": ("moving average", "parabola", "half sine", "cosine"),
    "specified insensitivity": ("SI, 0.2", "SI, 0.45", "SI, 0.7"),
    "two modes": ("ZV x ZV", "ZVD x ZVD", "both together"),
}
SECOND = 2.2  # frequency of the second mode, of the first
SPECIFIED = {
    f"SI, {width:g}": lambda f, zeta=0.0, width=width: ctl.si(f, zeta, width) for width in (0.2, 0.45, 0.7)
}
TWO_MODES = {
    "ZV x ZV": lambda f, zeta=0.0: ctl.convolve(ctl.zv(f, zeta), ctl.zv(SECOND * f, zeta)),
    "ZVD x ZVD": lambda f, zeta=0.0: ctl.convolve(ctl.zvd(f, zeta), ctl.zvd(SECOND * f, zeta)),
    "both together": lambda f, zeta=0.0: ctl.simultaneous(jnp.array([f, SECOND * f]), jnp.full(2, zeta)),
}
ALL = ctl.SHAPERS | SPECIFIED | TWO_MODES
WIDTHS = np.linspace(0.0, 0.9, 46)  # of SI


def run(folder: Path, reduced: bool) -> dict:
    """How far off may the mode be, and what does that cost in time?"""
    draw_curves(101 if reduced else 801).savefig(folder / "curves.png", dpi=130)
    widths = WIDTHS[::9] if reduced else WIDTHS
    times = {
        share: [float(ctl.si(1.0, 0.0, float(w), share).duration()) for w in widths] for share in (0.05, 0.02)
    }
    table = {
        name: {
            "duration_periods": float(make(1.0).duration()),
            "insensitivity": float(ctl.insensitivity(make(1.0), 1.0)),
            "insensitivity_damped": float(ctl.insensitivity(make(1.0, DAMPING), 1.0, DAMPING)),
            "published": PUBLISHED.get(name),
        }
        for name, make in (ctl.SHAPERS | SPECIFIED).items()
    }
    draw_costs(table, widths, times).savefig(folder / "costs.png", dpi=130)
    return {"tolerance": 0.05, "damping_ratio": DAMPING, "shapers": table}


def draw_curves(count: int):
    """Residual against frequency, without damping and with, a panel for each family."""
    made, axes = figure(3, 2, height=3.0, width=11.0)
    for axis, (title, names) in zip(axes.flat, GROUPS.items(), strict=True):
        places = jnp.linspace(0.3, 1.9 if title != "two modes" else 3.0, count)
        for i, name in enumerate(names):
            for zeta, style in ((0.0, "-"), (DAMPING, ":")):
                curve = ctl.residual_curve(ALL[name](1.0, zeta), places, zeta)
                label = name if zeta == 0 else None
                axis.plot(places, 100 * curve, style, color=f"C{i}", linewidth=1.3, label=label)
        axis.axhline(5.0, color="0.4", linewidth=0.8, linestyle="--")
        axis.set_ylim(0, 60)
        axis.set_title(title, fontsize=10)
        axis.legend(fontsize=8, frameon=False, loc="upper center")
    for axis in axes[-1]:
        axis.set_xlabel("frequency of the mode, share of that designed for [1]")
    for axis in axes[:, 0]:
        axis.set_ylabel("vibration left [%]")
    axes[0, 0].plot([], [], "k:", label=f"damping ratio {DAMPING:g}")
    axes[0, 0].legend(fontsize=8, frameon=False, loc="upper center")
    return made


def draw_costs(table: dict, widths: np.ndarray, times: dict):
    """Duration against insensitivity: the shapers as points, SI as the least there is."""
    made, axes = figure(1, 1, height=4.2, width=8.0)
    axis = axes[0, 0]
    for (share, durations), colour in zip(times.items(), ("0.3", "0.65"), strict=True):
        axis.plot(widths, durations, color=colour, label=f"SI, {100 * share:g} % left")
    for i, (name, row) in enumerate(table.items()):
        if row["insensitivity"] <= 1.05 and name not in SPECIFIED:
            axis.plot(row["insensitivity"], row["duration_periods"], "o", color=f"C{i % 10}")
            axis.annotate(
                name, (row["insensitivity"], row["duration_periods"]), xytext=(6, -3),
                textcoords="offset points", fontsize=8, color=f"C{i % 10}",
            )  # fmt: skip
    axis.set_xlabel("insensitivity at 5 %: width of the band, share of the frequency [1]")
    axis.set_ylabel("duration [periods]")
    axis.set_xlim(0, 1.15)
    axis.legend(fontsize=8, frameon=False, loc="lower right")
    return made
