"""Minimise a cost by gradient, step by step, so that progress can be seen and time limited."""

import time
from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Float

from jaxflex import Scalar, value_and_gradient

Free = Float[Array, " free"]


class Minimum(NamedTuple):
    """Where a minimisation ended.

    `free` the best point met, `cost` there, `history` of the best cost after every step,
    `steps` taken, and `reason` it stopped, in words.
    """

    free: Free
    cost: float
    history: list[float]
    steps: int
    reason: str


def with_gradient(cost: Callable[[Free], Scalar]) -> Callable[[Free], Scalar]:
    """`cost`, whose derivative is computed together with it, in the mode that suits their number.

    A minimiser that linearises its function then runs the simulation once a step.
    """

    @jax.custom_jvp
    def call(free):
        return cost(free)

    @call.defjvp
    def _(primals, tangents):
        value, gradient = value_and_gradient(cost)(primals[0])
        return value, jnp.dot(gradient, tangents[0])

    return call


def make_stepper(cost: Callable[[Free], Scalar], minimiser: optx.AbstractMinimiser, example: Free):
    """Functions `start(free)` and `step(free, state)`, compiled once for all starts."""
    options = {"autodiff_mode": "fwd"}
    cost = with_gradient(cost)
    shape = jax.eval_shape(lambda: jnp.zeros((), example.dtype))

    def fn(free, args):
        return cost(free), None

    @eqx.filter_jit
    def start(free):
        return minimiser.init(fn, free, None, options, shape, None, frozenset())

    @eqx.filter_jit
    def step(free, state):
        free, state, _ = minimiser.step(fn, free, None, options, state, frozenset())
        done, result = minimiser.terminate(fn, free, None, options, state, frozenset())
        return free, state, done, result == optx.RESULTS.successful

    return start, step


def minimise(
    stepper,
    free: Free,
    max_steps: int,
    seconds: float | None = None,
    progress: Callable[[int, float], None] | None = None,
) -> Minimum:
    """Run a stepper from `free` until it has converged, or for `max_steps` or `seconds`.

    A cost that is not finite is no better than any other: the search backs away from
    it. `progress(step, best cost)` is called after every step.
    """
    start, step = stepper
    began = time.monotonic()
    state = start(free)
    best, best_cost, history = free, np.inf, []
    reason = f"stopped after the {max_steps} steps allowed, not converged"
    for number in range(1, max_steps + 1):
        free, state, done, good = step(free, state)
        cost = float(state.f_info.f)
        if np.isfinite(cost) and cost < best_cost:
            best, best_cost = free, cost
        history.append(best_cost)
        if progress is not None:
            progress(number, best_cost)
        if bool(done):
            reason = "converged" if bool(good) else "stopped: the minimiser failed"
            break
        if seconds is not None and time.monotonic() - began > seconds:
            reason = f"stopped after the {seconds:g} s allowed, not converged"
            break
    return Minimum(best, best_cost, history, len(history), reason)
