"""The arm beyond the paper: closed loop, shaped, tuned; on a tilted base; with a third link."""

from pathlib import Path
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

import controllers as ctl
import jaxflex as jf
from jaxflex.cli.tune import make_problem

from .arms import TILT, sag, three_links, tilted
from .pictures import plot_moves

PAYLOADS = (0.0, 0.02, 0.05, 0.08, 0.1)  # kg
TUNED_ON = [0.0, 0.05, 0.1]  # kg; the others are new to the tuned design
SHAPER = "ZVD"


class Case(NamedTuple):
    """An arm with its designs, how they fare over `PAYLOADS`, and their runs."""

    designs: dict[str, ctl.Design]
    assessment: ctl.Assessment
    trajectory: jf.Trajectory


def designs(arm: jf.Arm, steps: int) -> dict[str, ctl.Design]:
    """Textbook PD, the same shaped, and the tuned design, all in equal time.

    The shaper is left out where it takes more than nine tenths of that time, the tuned design if `steps` is 0.
    """
    move = ctl.default_move(arm)
    pose = jnp.stack(move.stop)
    problem = make_problem(arm, TUNED_ON, move)
    total = problem.total_time()
    textbook = ctl.textbook_pd(arm, pose)
    found = {"textbook PD": ctl.unshaped_design(textbook, move, total)}
    shaped = ctl.classical_designs(arm, textbook, move, total)
    if SHAPER in shaped:
        found[f"textbook PD, {SHAPER}"] = shaped[SHAPER]
    if steps:
        start = ctl.standard_start(problem)
        tuned = ctl.tune(problem, start, starts=4, descents=1, max_steps=steps, seed=0)
        found["tuned"] = problem.design(tuned.values)
    return found


def fare(arm: jf.Arm, chosen: dict[str, ctl.Design]) -> Case:
    """Every design with every payload."""
    end = float(max(design.move_time() for design in chosen.values()))
    watch = 2 / float(jf.locked_frequencies(arm)[0])
    times = jnp.linspace(0.0, end + watch, 601)
    arms = ctl.with_payloads(arm, jnp.asarray(PAYLOADS))
    return Case(chosen, *ctl.assess(ctl.stack(list(chosen.values())), arms, times))


def run(folder: Path, reduced: bool) -> dict[str, Any]:
    """What do feedback, a shaper and tuning buy on this arm, with gravity and with a third link?"""
    two, three = jf.ahmad_arm(0.05, modes=1 if reduced else 2), three_links(0.05)
    steps = 0 if reduced else 24
    own = designs(two, steps)
    cases = {} if reduced else {"two links": fare(two, own)}
    cases[f"two links, base tilted by {TILT:g} deg"] = fare(tilted(two, TILT), own)
    if not reduced:
        cases["three links"] = fare(three, designs(three, steps))
        plot_moves(cases, PAYLOADS.index(0.05)).savefig(folder / "moves.png", dpi=130)
    return {
        "payload_g": [1000 * p for p in PAYLOADS],
        "designs": {name: _figures(case) for name, case in cases.items()},
        "sag_pct_of_length": {
            f"{name}, base tilted by {degrees:g} deg": [_round(100 * s) for s in sag(tilted(arm, degrees))]
            for name, arm in (("two links", two), ("three links", three))
            for degrees in (TILT, 90.0)
        },
        "frequencies_hz": {
            name: {
                "joints free": [_round(v) for v in jf.driven_frequencies(arm)[len(arm.joints) :]],
                "joints locked": [_round(v) for v in jf.locked_frequencies(arm)],
            }
            for name, arm in (("two links", two), ("three links", three))
        },
    }


def _figures(case: Case) -> dict[str, Any]:
    seen = case.assessment
    return {
        name: {
            "move_time_s": _round(design.move_time()),
            "residual_vibration_mm": [_round(1e3 * v) for v in seen.residual_vibration[i]],
            "peak_voltage_V": [_round(v) for v in seen.peak_voltage[i]],
            "largest_deflection_pct_of_length": [_round(100 * v) for v in seen.deflection[i]],
        }
        for i, (name, design) in enumerate(case.designs.items())
    }


def _round(value) -> float | None:
    """Four figures; None where there is none, as JSON wants it."""
    return float(f"{float(value):.4g}") if np.isfinite(value) else None
