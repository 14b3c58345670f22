"""Tune any parameters for any cost under hard constraints, by gradient, from several starts.

Constraints are met by an augmented Lagrangian (Nocedal and Wright 2006, 17.3): rounds of
descents on `f + sum of rho/2 (max(0, lambda / rho + g)^2 - (lambda / rho)^2)`, each after
the multipliers lambda have taken over what the penalty held in the round before.
"""

import math
from abc import abstractmethod
from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, PyTree

from jaxflex import Scalar, one_off

from .bijections import AbstractBijection
from .judge import Free, Starts
from .minimise import Minimum, Stepper, minimise
from .task import Outcome

KEPT = 1e-2  # relative excess up to which a constraint counts as kept


def _is_domain(node) -> bool:
    return isinstance(node, AbstractBijection)


class AbstractProblem(eqx.Module):
    """Something to be tuned: parameters in their domains, and what becomes of them."""

    @abstractmethod
    def domains(self) -> PyTree:
        """A bijection for each part of the pytree of parameters: a prefix of it, a subtree sharing one."""

    @abstractmethod
    def outcome(self, values: PyTree) -> Outcome:
        """Cost and constraints of parameters, a pure function of them."""

    def free(self, values: PyTree) -> Free:
        """The unconstrained vector that stands for these parameters."""
        parts = jax.tree_util.tree_map(
            lambda domain, part: domain.free(ravel_pytree(part)[0]),
            self.domains(),
            values,
            is_leaf=_is_domain,
        )
        return jnp.concatenate(jax.tree_util.tree_leaves(parts))

    def values(self, free: Free, like: PyTree) -> PyTree:
        """The parameters that `free` stands for, a pytree of the structure and shapes of `like`."""
        place = 0

        def take(domain, part):
            nonlocal place
            flat, unravel = ravel_pytree(part)
            size = jax.eval_shape(domain.free, flat).shape[0]
            place += size
            return unravel(domain.value(free[place - size : place]))

        return jax.tree_util.tree_map(take, self.domains(), like, is_leaf=_is_domain)


class Freely(AbstractProblem):
    """Any parameters, by a function that judges them.

    **Fields**: `judge`, from parameters to an `Outcome`, a pure function (such as
    `lambda gains: task.outcome(design_with(gains))`; a callable module keeps its arrays
    out of the compiled program); `bounds`, a pytree of bijections, for instance
    `Positive()` for a whole `PD`, or `{"gains": Positive(), "delays": Delays(0.5)}`.
    """

    judge: Callable[[PyTree], Outcome]
    bounds: PyTree

    def domains(self) -> PyTree:
        """The bounds."""
        return self.bounds

    def outcome(self, values: PyTree) -> Outcome:
        """As `judge` says."""
        return self.judge(values)


class Tuned(NamedTuple):
    """The outcome of `tune`.

    `values`, the best parameters; their `cost` and greatest relative `excess` over the constraints (zero
    if none is exceeded) and `measures`; `minima`, one a descent, the last round of each; `evaluations`, of cost and
    gradient, over all starts and rounds.
    """

    values: PyTree
    cost: float
    excess: float
    measures: dict[str, np.ndarray] | None
    minima: list[Minimum]
    evaluations: int


def lagrangian(free: Free, args: PyTree) -> tuple[Scalar, tuple[Scalar, Array, dict[str, Array] | None]]:
    """Cost with what the constraints add to it; beside it the cost, the excesses in a row, and the measures."""
    (problem, like), (multipliers, penalty) = args
    cost, excess, measures = problem.outcome(problem.values(free, like))
    if not excess:
        return cost, (cost, jnp.zeros(0), measures)
    row = jnp.concatenate([jnp.ravel(g) for g in excess.values()])
    # scenarios of one constraint share its weight, so that their number does not count
    share = jnp.concatenate([jnp.full(jnp.size(g), 1 / jnp.size(g)) for g in excess.values()])
    held = multipliers / penalty
    added = penalty / 2 * jnp.sum(share * (jnp.maximum(0.0, held + row) ** 2 - held**2))
    return cost + added, (cost, row, measures)


def scattered(first: Free, count: int, seed: int) -> Starts:
    """`count` points to start from: `first`, and others scattered about it (normal, one unit wide)."""
    scatter = jax.random.normal(jax.random.key(seed), (count - 1, first.shape[0]), first.dtype)
    return jnp.concatenate([first[None], first + scatter])


def tune(
    problem: AbstractProblem,
    first: PyTree,
    starts: int = 8,
    descents: int = 2,
    max_steps: int = 60,
    rounds: int = 1,
    penalty: float = 600.0,
    together: int = 1,
    seconds: float | None = None,
    seed: int = 0,
    minimiser: optx.AbstractMinimiser | None = None,
    progress: Callable[[str, int, float], None] | None = None,
) -> Tuned:
    """Parameters of least cost that keep the constraints, from several starts.

    `starts` points about `first` are tried, the `descents` best of them followed down by
    `minimiser` (BFGS unless told), `together` of them at once by `vmap` (1: one after the
    other, which wastes least on one core). Each descent has `max_steps` evaluations and
    an equal share of `seconds`, over `rounds` of the augmented Lagrangian: with one, the
    constraints are penalties of weight `penalty` and may be exceeded a little; four or so
    bring them home. `progress(what, step, cost)` is called on the way.

    **Raises** `RuntimeError` if no start can be simulated.
    """
    points = scattered(_free(problem, first), starts, seed)
    stepper = Stepper(lagrangian, minimiser or optx.BFGS(rtol=1e-4, atol=1e-4))
    args = (problem, first)
    count = 1  # with one round multipliers stay zero, and one stands for all
    if rounds > 1:
        probe = eqx.filter_eval_shape(lagrangian, points[0], (args, (jnp.zeros(()), jnp.ones(()))))
        count = probe[1][1].shape[0]
    together = min(together, starts, descents)

    def fresh(size):
        return jnp.zeros((size, count)), jnp.full(size, penalty)

    def chunks(rows):
        # every chunk has the same size, so that one program serves all: the last row fills the last chunk
        for k in range(0, len(rows), together):
            chunk = rows[k : k + together]
            yield k, len(chunk), jnp.stack([*chunk, *[chunk[-1]] * (together - len(chunk))])

    ranked: list[float] = []
    for _, size, chunk in chunks(list(points)):
        # the first step only evaluates, and needs no program of its own
        ranked += [m.cost for m in minimise(stepper, chunk, 1, args, fresh(together))[:size]]
        if progress is not None:
            progress("starts", len(ranked), min(ranked))
    order = np.argsort(ranked, kind="stable")[:descents]
    if not np.isfinite(ranked[order[0]]):
        raise RuntimeError(
            "no start of the tuning could be simulated: the loop is unstable or too stiff with all "
            "of them; begin from other gains or a slower move."
        )
    found: list[tuple[bool, float, float, Minimum]] = []
    minima, evaluations = [], starts
    for k, size, free in chunks([points[i] for i in order]):
        own, before = fresh(together), np.full(together, np.inf)
        for turn in range(rounds):

            def report(step, value, number=k + 1, turn=turn):
                if progress is not None:
                    progress(f"descent {number}", turn * math.ceil(max_steps / rounds) + step, value)

            budget = None if seconds is None else seconds * together / (descents * rounds)
            ended = minimise(stepper, free, math.ceil(max_steps / rounds), args, own, budget, report)
            evaluations += sum(m.steps for m in ended[:size])
            for m in ended[:size]:
                cost, row, _ = m.aux
                excess = float(np.max(row, initial=0.0))
                found.append((excess > KEPT, excess if excess > KEPT else 0.0, float(cost), m))
            if turn + 1 == rounds:
                break
            rows = np.stack([m.aux[1] for m in ended])
            own, before = _updated(own, rows, before)
            free = jnp.stack([m.free for m in ended])  # noqa: PLW2901
        minima += ended[:size]
    # in one round constraints are penalties, and their sum with the cost is what was to be least
    best = min(minima, key=lambda m: m.cost) if rounds == 1 else min(found, key=lambda f: f[:3])[3]
    cost, row, measures = best.aux
    excess = float(np.max(row, initial=0.0))
    return Tuned(_values(problem, best.free, first), float(cost), excess, measures, minima, evaluations)


@one_off
def _free(problem: AbstractProblem, values: PyTree) -> Free:
    return problem.free(values)


@one_off
def _values(problem: AbstractProblem, free: Free, like: PyTree) -> PyTree:
    return problem.values(free, like)


def _updated(own: tuple, rows: np.ndarray, before: np.ndarray) -> tuple[tuple, np.ndarray]:
    """Multipliers and penalties after a round, start by start; a penalty grows where the excess did not fall."""
    multipliers, penalty = own
    now = np.maximum(rows, 0.0).max(axis=1, initial=0.0)
    after = jnp.maximum(0.0, multipliers + penalty[:, None] * rows)
    grown = jnp.where(jnp.asarray((now > 0.25 * before) & (now > KEPT / 2)), 4 * penalty, penalty)
    return (after, grown), now
