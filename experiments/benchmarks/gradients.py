"""What a gradient of a tuning cost costs, forwards and backwards, against the number of parameters."""

import time

import diffrax
import jax
import jax.numpy as jnp

import jaxflex as jf
from controllers import Sampled
from controllers.judge import judge

from .problem import DURATION, GAINS, STOP, sweep
from .timing import best_of, compiled

PAYLOADS = 6
TIMES = jnp.linspace(0.0, DURATION, 101)


def cost(parameters: jax.Array, adjoint: diffrax.AbstractAdjoint) -> jax.Array:
    """Mean square speed of the tip after the move, the reference being `parameters` at equal times."""
    course = jnp.reshape(parameters, (2, -1)).T
    reference = Sampled(jnp.linspace(0.0, 1.5, course.shape[0]), course, "cubic")
    arms = sweep(PAYLOADS)

    def one(payload):
        run = jf.simulate(
            arms.arm(payload), GAINS, reference, TIMES,
            method=jf.Fixed(8e-4), channels=["tip_x", "tip_y"], adjoint=adjoint,
        )  # fmt: skip
        return jnp.mean(jnp.sum(jnp.diff(run.tip[75:], axis=0) ** 2, axis=1))

    return jnp.mean(jax.vmap(one)(jnp.asarray(arms.payloads)))


def objective(parameters: jax.Array, args: None):
    """The cost as a tuning asks for it."""
    return cost(parameters, diffrax.ForwardMode()), args


def measure(counts: tuple[int, ...]) -> list[dict]:
    """Seconds of the cost, and of its gradient in both modes as multiples of it.

    Few parameters in groups on all cores as well, as a tuning has them, by the clock.
    """
    found = []
    forwards, backwards = diffrax.ForwardMode(), diffrax.RecursiveCheckpointAdjoint()
    for count in counts:
        course = jnp.linspace(0.0, 1.0, count // 2)
        start = jnp.concatenate([STOP[0] * course, STOP[1] * course])
        programs = {
            "cost": lambda p: cost(p, forwards),
            "forward": jax.jacfwd(lambda p: cost(p, forwards)),
            "reverse": jax.grad(lambda p: cost(p, backwards)),
        }
        row: dict = {"parameters": count}
        calls = {}
        for name, program in programs.items():
            call, seconds = compiled(program, start)
            calls[name] = call
            # on one core, and of the processor's seconds: others' work counts in neither
            row[name], row[f"{name} compile"] = best_of(call, 8, time.process_time), seconds
        if isinstance(jf.adjoint_for(count), diffrax.ForwardMode):
            points = start[None]
            judge(objective, points, None, None)  # compiles
            by_clock = best_of(lambda points=points: judge(objective, points, None, None), 8)
            row["groups / cost"] = by_clock / best_of(calls["cost"], 8)
        row["forward / cost"] = row["forward"] / row["cost"]
        row["reverse / cost"] = row["reverse"] / row["cost"]
        found.append(row)
    return found
