"""The gradient-tuned free shaper against the optimum, on a single link and on a two-link arm."""

from pathlib import Path

import jax.numpy as jnp
import numpy as np

import controllers as ctl
import jaxflex as jf

from .optimum import optimum
from .pictures import draw_impulses, draw_motion

ARMS = Path(__file__).parents[1] / "arms"
LENGTHS = (0.25, 0.5, 0.75, 1.0, 1.5)  # of the shaper, in periods of the lowest locked frequency
WATCH = 3.0  # periods of it for which the tip is watched
IMPULSES = 8
STIFF = 1.5  # bandwidth of the stiff PD, in lowest locked frequencies: the links ring against it


def loop(arm: jf.Arm, payloads: np.ndarray, bandwidth: float | None) -> tuple[ctl.FreeMotion, float]:
    """What the standard move leaves for every payload under a PD, and the locked period [s].

    `bandwidth` of the PD as a multiple of the lowest locked frequency; a third by default.
    """
    middle = arm.with_payload(float(np.median(payloads)))
    move = ctl.default_move(middle)
    pose = jnp.stack(move.stop)
    locked = jf.locked_frequencies(middle, pose)[0]
    omega = None if bandwidth is None else 2 * jnp.pi * locked * bandwidth
    pd = ctl.textbook_pd(middle, pose, omega, feedforward=True)
    motions = [ctl.free_motion(arm.with_payload(float(p)), pd, move) for p in payloads]
    return ctl.stack_motions(motions), 1 / float(locked)


def run(folder: Path, reduced: bool) -> dict:
    """How near does the gradient-tuned free shaper come to the best shaper there is?"""
    count, points = (3, 61) if reduced else (5, 161)
    link, links = jf.load_arm(ARMS / "foldager_link.toml"), jf.ahmad_arm()
    light, heavy = np.linspace(0.0, 0.04, count), np.linspace(0.0, 0.1, count)
    cases = {
        "single link": (link, light, None),
        "single link, stiff joint": (link, light, STIFF),
        "two-link arm": (links, heavy, None),
        "two-link arm, stiff joints": (links, heavy, STIFF),
    }
    if reduced:
        cases = {name: cases[name] for name in ("single link", "two-link arm, stiff joints")}
    figures: dict = {}
    shown = {}
    for name, (arm, payloads, bandwidth) in cases.items():
        motions, period = loop(arm, payloads, bandwidth)
        times = jnp.linspace(0.0, WATCH * period, 121 if reduced else 241)
        rows = []
        for length in (LENGTHS[3],) if reduced else LENGTHS:
            duration = length * period
            best = optimum(motions, duration, times, points)
            finer = optimum(motions, duration, times, 2 * points - 1).worst
            tuned = ctl.tune_shaper(
                motions,
                duration,
                times,
                IMPULSES,
                starts=1 if reduced else 8,
                max_steps=100 if reduced else 200,
            )
            if length == LENGTHS[3]:
                shown[name] = (motions, payloads, duration, times, best, tuned.shaper)
            rows.append(
                {
                    "shaper_periods": length,
                    "shaper_s": duration,
                    "unshaped_mm": 1e3 * worst(motions, ctl.unshaped(), times),
                    "optimum_mm": 1e3 * best.worst,
                    "optimum_on_half_the_grid_mm": 1e3 * finer,
                    "tuned_mm": 1e3 * float(tuned.worst),
                    "tuned_over_optimum": float(tuned.worst) / finer,
                    "standard_start_over_optimum": float(tuned.from_starts[0]) / finer,
                    "worst_start_over_optimum": float(tuned.from_starts.max()) / finer,
                    "optimum_impulses": best.impulses(),
                    "tuned_amplitudes": tuned.shaper.amplitudes.tolist(),
                    "tuned_delays_s": tuned.shaper.delays.tolist(),
                }
            )
        figures[name] = {"period_s": period, "payloads_kg": payloads.tolist(), "rows": rows}
    draw_impulses(shown).savefig(folder / "impulses.png", dpi=130)
    draw_motion(shown).savefig(folder / "motion.png", dpi=130)
    return figures


def worst(motions: ctl.FreeMotion, shaper: ctl.Shaper, times) -> float:
    """Largest residual [m] over a batch of motions."""
    paths = jnp.stack([ctl.tip_after(one(motions, i), shaper, times) for i in range(len(motions.poles))])
    return max(float(jf.residual_vibration(times, path, times[0], jnp.zeros(2))) for path in paths)


def one(motions: ctl.FreeMotion, i: int) -> ctl.FreeMotion:
    """Member i of a batch."""
    return ctl.FreeMotion(motions.poles[i], motions.tip[i])
