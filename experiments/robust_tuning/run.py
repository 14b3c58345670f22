"""How much vibration does a shorter move cost, and does a tuned design hold on arms it was not tuned on?"""

from pathlib import Path

import jax.numpy as jnp
import numpy as np

import controllers as ctl
import jaxflex as jf
from controllers.pareto import at_pace
from jaxflex.plotting import plot_pareto

from . import pictures

TUNED_ON = (0.0, 0.02, 0.04)  # kg
HELD_OUT = (0.005, 0.015, 0.03)  # kg, between those
AGGREGATES = {
    "mean": ctl.Mean(),
    "worst case": ctl.Worst(20.0),
    "CVaR, worst 40 %": ctl.ConditionalValueAtRisk(0.6),
}


def problem() -> ctl.Problem:
    """Gains and free shaper for Foldager's link."""
    arm = jf.foldager_link(0.02, modes=1)
    move = ctl.default_move(arm)
    start = ctl.textbook_pd(arm, jnp.stack(move.stop), feedforward=True)
    period = 1 / jf.locked_frequencies(arm)[0]
    return ctl.Problem(arm, jnp.asarray(TUNED_ON), move, start, 0.45 * period, watch=2 * period)


def residual(designs: list[ctl.Design], arms: jf.Arm, end: float, watch: float) -> np.ndarray:
    """Residual vibration [mm] of every design on every arm."""
    times = jnp.linspace(0.0, end + watch, 801)
    measures, runs = ctl.assess(ctl.stack(designs), arms, times)
    runs.check()
    return 1e3 * np.asarray(measures.residual_vibration)


def textbook(posed: ctl.Problem, move_times: np.ndarray) -> dict[str, np.ndarray]:
    """Worst residual vibration [m] over the payloads of textbook gains, unshaped and with the best classical shaper."""
    arms = ctl.with_payloads(posed.arm, posed.payloads)
    found: dict[str, list[float]] = {}
    for law in ("PD", "PD with feedforward"):
        gains = ctl.textbook_pd(posed.arm, jnp.stack(posed.move.stop), feedforward=law != "PD")
        for total in move_times:
            designs = [
                ctl.unshaped_design(gains, posed.move, total),
                *ctl.classical_designs(posed.arm, gains, posed.move, total).values(),
            ]
            worst = residual(designs, arms, float(total), float(posed.watch)).max(axis=1) / 1e3
            found.setdefault(f"textbook {law}, unshaped", []).append(float(worst[0]))
            found.setdefault(f"textbook {law}, best classical shaper", []).append(float(worst[1:].min()))
    return {name: np.array(values) for name, values in found.items()}


def run(folder: Path, reduced: bool) -> dict:
    """The front, then three aggregates of the payloads on arms that differ from those tuned on."""
    posed = problem()
    total, watch = float(posed.total_time()), float(posed.watch)
    steps = 10 if reduced else 50
    paces = [0.8, 1.0] if reduced else [0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2]
    move_times = total * np.array(paces)
    front = ctl.pareto_front(posed, move_times, starts=2, descents=1, max_steps=steps)
    designs = [
        at_pace(posed, float(t) / total).design(tuned.values)
        for t, tuned in zip(front.move_time, front.tuned, strict=True)
    ]
    arms = ctl.with_payloads(posed.arm, jnp.asarray(HELD_OUT))
    held_out = [
        float(residual([design], arms, float(t), watch).max())
        for design, t in zip(designs, front.move_time, strict=True)
    ]
    others = textbook(posed, move_times)
    picture = plot_pareto(front.move_time, front.residual_vibration, front.efficient, others)
    picture.savefig(folder / "pareto.png", dpi=130)

    factors = np.linspace(0.8, 1.2, 5 if reduced else 13)
    chosen = {"textbook PD with feedforward": ctl.unshaped_design(posed.start, posed.move, total)}
    kept = {}
    for name in ["worst case"] if reduced else AGGREGATES:
        aggregate = AGGREGATES[name]
        again = ctl.Problem(
            posed.arm, posed.payloads, posed.move, posed.start, posed.shaper_time, watch=posed.watch,
            weights=ctl.Weights(aggregate),
        )  # fmt: skip
        # hard limits: what a penalty let pass is brought back by the multipliers
        tuned = ctl.tune(
            again,
            ctl.standard_start(again),
            starts=2,
            descents=1,
            max_steps=2 * steps,
            rounds=1 if reduced else 4,
        )
        chosen[f"tuned, {name}"] = again.design(tuned.values)
        kept[f"tuned, {name}"] = tuned.excess
    ones, middle = jnp.ones(len(factors)), jnp.full(len(factors), 0.02)
    sweeps = {
        "payload": (np.linspace(0.0, 0.05, len(factors)), None),
        "stiffness": (factors, ctl.varied(posed.arm, middle, stiffness=jnp.asarray(factors))),
        "damping": (5.0 ** np.linspace(-1, 1, len(factors)), None),
    }
    sweeps["payload"] = (sweeps["payload"][0], ctl.varied(posed.arm, jnp.asarray(sweeps["payload"][0])))
    spread = jnp.asarray(sweeps["damping"][0])
    sweeps["damping"] = (sweeps["damping"][0], ctl.varied(posed.arm, middle, ones, spread))
    curves = {what: residual(list(chosen.values()), arms, total, watch) for what, (_, arms) in sweeps.items()}
    places = {what: values for what, (values, _) in sweeps.items()}
    pictures.robustness(places, curves, list(chosen), TUNED_ON).savefig(folder / "robustness.png", dpi=130)
    return {
        "move_time_s": front.move_time.tolist(),
        "front_mm": (1e3 * front.residual_vibration).tolist(),
        "front_held_out_payloads_mm": held_out,
        "efficient": front.efficient.tolist(),
        "others_mm": {name: (1e3 * values).tolist() for name, values in others.items()},
        "greatest_excess": kept,
        "sweeps": {
            what: {"at": places[what].tolist()}
            | {name: row.tolist() for name, row in zip(chosen, curves[what], strict=True)}
            for what in places
        },
    }
