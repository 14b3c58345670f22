"""The problem that every method is given, and its price in simulations."""

import time
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

import controllers as ctl
import jaxflex as jf
from controllers.tuning import lagrangian, scattered

PENALTY = 600.0


class Spent(Exception):
    """The budget is used up."""


class Counter:
    """A cost over free vectors that counts simulations and seconds of the processor, and keeps the best value.

    A gradient, computed forwards, carries one tangent for each of n parameters through the
    simulation: it is charged as n simulations more. Programs are compiled before the clock starts.
    """

    def __init__(self, problem: ctl.AbstractProblem, first, batch: int):
        args = ((problem, first), (jnp.zeros(()), jnp.asarray(PENALTY)))
        centre = problem.free(first)
        args = (args[0], (jnp.zeros(jax.eval_shape(lambda p: _row(p, args), centre).shape), args[1][1]))
        self.centre, self.batch, self.size = np.asarray(centre), batch, centre.shape[0]
        self._one = jax.jit(lambda x: lagrangian(x, args)[0])
        self._many = jax.jit(jax.vmap(lambda x: lagrangian(x, args)[0]))
        self._both = jax.jit(jf.value_and_gradient(lambda x: lagrangian(x, args)[0]))
        began = time.process_time()
        jax.block_until_ready((self._one(centre), self._both(centre)))
        self.compile_one = time.process_time() - began
        jax.block_until_ready(self._many(jnp.tile(centre, (batch, 1))))
        self.compile_seconds = time.process_time() - began

    def begin(self, simulations: int, seconds: float) -> "Counter":
        """Start the clock with a budget of either kind, whichever allows more."""
        self.spent, self.best, self.trace = 0, np.inf, []
        self.simulations, self.seconds, self.began = simulations, seconds, time.process_time()
        return self

    def _note(self, values, price: int) -> None:
        self.spent += price
        finite = [v for v in np.ravel(values) if np.isfinite(v)]
        self.best = min([self.best, *finite])
        elapsed = time.process_time() - self.began
        self.trace.append((self.spent, elapsed, float(self.best)))
        if self.spent >= self.simulations and elapsed >= self.seconds:
            raise Spent

    def one(self, x) -> float:
        """Cost of one point; a failed simulation costs a large number that methods can compare."""
        value = float(self._one(jnp.asarray(x)))
        self._note(value, 1)
        return value if np.isfinite(value) else 1e3

    def many(self, points) -> np.ndarray:
        """Costs of as many points as the batch holds, or fewer, in one vectorised call."""
        points = np.atleast_2d(points)
        full = np.concatenate([points, np.tile(points[-1], (self.batch - len(points), 1))])
        values = np.asarray(self._many(jnp.asarray(full)))[: len(points)]
        self._note(values, len(points))
        return np.where(np.isfinite(values), values, 1e3)

    def both(self, x) -> tuple[float, np.ndarray]:
        """Cost and gradient of one point."""
        value, slope = self._both(jnp.asarray(x))
        value, slope = float(value), np.asarray(slope)
        self._note(value, 1 + self.size)
        return (value, slope) if np.isfinite(value) else (1e3, np.zeros(self.size))


def _row(free, args):
    return lagrangian(free, args)[1][1]


def single_link(reduced: bool) -> tuple[ctl.Problem, dict]:
    """Gains and free shaper for Foldager's link and two or three payloads, as `jaxflex tune` poses it."""
    arm = jf.foldager_link(0.02, modes=1)
    move = ctl.default_move(arm)
    start = ctl.textbook_pd(arm, jnp.stack(move.stop), feedforward=True)
    payloads = jnp.array([0.0, 0.04]) if reduced else jnp.array([0.0, 0.02, 0.04])
    period = 1 / jf.locked_frequencies(arm)[0]
    problem = ctl.Problem(
        arm, payloads, move, start, 0.45 * period, watch=2 * period, samples=61 if reduced else 121
    )
    return problem, ctl.standard_start(problem)


def starts(counter: Counter, count: int) -> list[np.ndarray]:
    """Points to start from, the same for every method: the standard start, and others about it."""
    return list(np.asarray(scattered(jnp.asarray(counter.centre), count, 0)))


Method = Callable[[Counter, np.ndarray, int], None]
