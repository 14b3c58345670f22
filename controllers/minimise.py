"""Minimise a cost by gradient, step by step, several starts at once, so that progress can be seen."""

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import PyTree

from jaxflex import Scalar, kept, value_and_gradient

from .judge import Free, Judged, Objective, Starts, each, judge

OPTIONS = {"autodiff_mode": "fwd"}


class Minimum(NamedTuple):
    """Where a minimisation ended.

    `free` the best point met, `cost` there and `aux` what else the objective said of it,
    `history` of the best cost after every step, `steps` taken, and `reason` it stopped, in words.
    """

    free: Free
    cost: float
    history: list[float]
    steps: int
    reason: str
    aux: Any = None


class Stepper(eqx.Module):
    """What is minimised and how.

    `objective(free, args)` returns a cost and, as a pytree of arrays, whatever else is
    worth knowing of a point. `minimiser` is one of optimistix that judge a point a step: `BFGS`, `LBFGS`, or
    any of optax as `optx.OptaxMinimiser(optax.adam(0.05), rtol, atol)`. Programs are
    compiled once for an objective and a minimiser, whatever the `args`.
    """

    objective: Objective
    minimiser: optx.AbstractMinimiser


def with_gradient(objective: Objective):
    """`objective`, its derivative computed together with it, in the mode that suits their number.

    What the objective returns beside its cost has no derivative.
    """

    def call(free, args):
        @jax.custom_jvp
        def of(free):
            return objective(free, args)

        @of.defjvp
        def _(primals, tangents):
            (value, aux), gradient = value_and_gradient(lambda x: objective(x, args), has_aux=True)(
                primals[0]
            )
            return (value, aux), (jnp.dot(gradient, tangents[0]), jax.tree_util.tree_map(_constant, aux))

        return of(free)

    return call


def _constant(leaf):
    """The tangent of what does not move."""
    exact = not jnp.issubdtype(leaf.dtype, jnp.inexact)
    return np.zeros(leaf.shape, jax.dtypes.float0) if exact else jnp.zeros_like(leaf)


def known(cost: Scalar, aux: PyTree, gradient: Free):
    """A function for a minimiser that asks for one point only, of which cost and gradient are known already.

    A minimiser differentiates its function itself, which for a simulation would be traced
    through layers of transformations, and run on one core.
    """

    @jax.custom_jvp
    def of(free):
        return cost

    @of.defjvp
    def _(primals, tangents):
        return cost, jnp.dot(gradient, tangents[0])

    return lambda free, args: (of(free), aux)


def _start(stepper: Stepper, free: Free, args: PyTree):
    cost, aux = eqx.filter_eval_shape(stepper.objective, free, args)
    return stepper.minimiser.init(stepper.objective, free, args, OPTIONS, cost, aux, frozenset())


def _step(minimiser: optx.AbstractMinimiser, fn: Callable, free: Free, state: PyTree, args: PyTree):
    """One step: the point it judged, with its cost and aux, and where it goes on from."""
    after, new, last_aux = minimiser.step(fn, free, args, OPTIONS, state, frozenset())
    done, result = minimiser.terminate(fn, after, args, OPTIONS, new, frozenset())
    if hasattr(new, "f_info"):  # quasi-Newton: it returns the last point accepted
        best = after, new.f_info.f, new.aux
    elif hasattr(new, "f"):  # optax: it returns the next point, not judged yet
        best = free, new.f, last_aux
    else:
        raise TypeError(
            f"minimise: {type(minimiser).__name__} does not say what its points cost; give BFGS, LBFGS, "
            "another quasi-Newton minimiser of optimistix, or an OptaxMinimiser."
        )
    return best, after, new, done, result == optx.RESULTS.successful


@kept
def _start_all(stepper: Stepper, free: Starts, args: PyTree, own: PyTree):
    return each(lambda x, o: _start(stepper, x, (args, o)), free, own)


@kept
def _go_on_all(minimiser: optx.AbstractMinimiser, free: Starts, state: PyTree, found: Judged):
    return each(lambda x, s, f: _step(minimiser, known(*f), x, s, None), free, state, found)


@kept
def _search_all(stepper: Stepper, free: Starts, state: PyTree, args: PyTree, own: PyTree):
    fn = with_gradient(stepper.objective)
    return each(lambda x, s, o: _step(stepper.minimiser, fn, x, s, (args, o)), free, state, own)


def _step_all(stepper: Stepper, free: Starts, state: PyTree, args: PyTree, own: PyTree):
    if not hasattr(state, "y_eval"):  # optax: a line search may ask for several points
        return _search_all(stepper, free, state, args, own)
    # quasi-Newton: it judges this point and no other
    return _go_on_all(stepper.minimiser, free, state, judge(stepper.objective, state.y_eval, args, own))


def minimise(
    stepper: Stepper,
    free: Starts,
    max_steps: int,
    args: PyTree = None,
    own: PyTree = None,
    seconds: float | None = None,
    progress: Callable[[int, float], None] | None = None,
) -> list[Minimum]:
    """Go down from every row of `free` at once, until all have converged, or for `max_steps` or `seconds`.

    The objective is called with `(args, own)`: `args` the same for every start, `own`
    with a leading axis of starts. A cost that is not finite is no better than any other: the search backs away
    from it. `progress(step, best cost)` is called after every step.
    """
    began, count = time.monotonic(), free.shape[0]
    state = _start_all(stepper, free, args, own)
    best: list = [None] * count
    costs, histories = np.full(count, np.inf), [[] for _ in range(count)]
    reasons = [f"stopped after the {max_steps} steps allowed, not converged"] * count
    over = np.zeros(count, bool)
    for number in range(1, max_steps + 1):
        judged, free_next, state, done, good = _step_all(stepper, free, state, args, own)
        (points, values, aux), free = judged, free_next
        values = np.asarray(values)
        for i in np.flatnonzero(~over):
            better = np.isfinite(values[i]) and values[i] < costs[i]
            if better or best[i] is None:
                best[i] = points[i], jax.tree_util.tree_map(lambda leaf, i=i: np.asarray(leaf[i]), aux)
            if better:
                costs[i] = values[i]
            histories[i].append(float(costs[i]))
            if done[i]:
                reasons[i] = "converged" if good[i] else "stopped: the minimiser failed"
                over[i] = True
        if progress is not None:
            progress(number, float(costs.min()))
        if over.all():
            break
        if seconds is not None and time.monotonic() - began > seconds:
            for i in np.flatnonzero(~over):
                reasons[i] = f"stopped after the {seconds:g} s allowed, not converged"
            break
    return [
        Minimum(best[i][0], float(costs[i]), histories[i], len(histories[i]), reasons[i], best[i][1])
        for i in range(count)
    ]
