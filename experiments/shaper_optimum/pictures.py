"""The optimum and the tuned shaper: their impulses, and the tip after the move."""

import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

import controllers as ctl

from ..pictures import MEASURED, OURS, figure


def draw_impulses(shown: dict) -> Figure:
    """Impulses of both over time."""
    made, axes = figure(len(shown) // 2, 2, height=2.8)
    for axis, (name, (_, _, duration, _, best, shaper)) in zip(axes.flat, shown.items(), strict=True):
        delays, amplitudes = np.array(best.impulses()).T
        for times, sizes, colour, marker, label in (
            (delays, amplitudes, MEASURED, "o", "optimum on a grid"),
            (np.asarray(shaper.delays), np.asarray(shaper.amplitudes), OURS, "x", "tuned by gradient"),
        ):
            axis.vlines(times, 0.0, sizes, color=colour, linewidth=1.2)
            axis.plot(times, sizes, marker, color=colour, markersize=6, label=label)
        axis.set_title(f"{name}, shaper of {duration:.3g} s", fontsize=10)
        axis.set_xlabel("delay [s]")
    for axis in axes[:, 0]:
        axis.set_ylabel("amplitude [1]")
    axes[0, 0].legend(fontsize=8, frameon=False)
    return made


def draw_motion(shown: dict) -> Figure:
    """Tip across its path after the move, every payload: unshaped, optimum, tuned."""
    made, axes = figure(len(shown), 3, height=2.6, width=12.0)
    for row, (name, (motions, payloads, _, times, best, shaper)) in enumerate(shown.items()):
        grid = ctl.Shaper(jnp.asarray(best.amplitudes), jnp.asarray(best.delays))
        panels = {"unshaped": ctl.unshaped(), "optimum": grid, "tuned by gradient": shaper}
        for column, (title, each) in enumerate(panels.items()):
            axis = axes[row, column]
            for i, payload in enumerate(payloads):
                motion = ctl.FreeMotion(motions.poles[i], motions.tip[i])
                tip = ctl.tip_after(motion, each, times)
                axis.plot(times, 1e3 * tip[:, 1], linewidth=1, label=f"{1e3 * payload:.0f} g")
            axis.set_title(f"{name}: {title}", fontsize=10)
            axis.set_xlabel("time after the move [s]")
            axis.sharey(axes[row, 0])
        axes[row, 0].set_ylabel("tip y about its rest [mm]")
    axes[0, 2].legend(title="payload", fontsize=7, title_fontsize=7, frameon=False)
    return made
