"""The free shaper tuned by gradient for a linear closed loop, over payloads.

Once a move is over, a linear loop is a sum of its modes: no simulation is needed, and a
thousand residuals cost a millisecond. The residual of the worst payload is a maximum
over payloads and instants; its gradient sees one of each at a time, and a descent along
it stalls in the first crease. A power mean in place of the maximum sees all of them, and
its power is raised from descent to descent until it is the maximum in all but name.
"""

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Complex, Float

from jaxflex import AbstractController, Arm, Scalar, ScalarLike, linearise, residual_vibration, scalar

from .bijections import Delays, Simplex
from .references import Move
from .shapers import Shaper

NODES = 40  # of a Gauss-Legendre rule, between two knots of the move
POWERS = (8.0, 32.0, 128.0, 512.0, 2048.0)
INSIDE = 0.1  # weight of the barrier, times the power


class FreeMotion(eqx.Module):
    """The tip about its resting place after an unshaped move: `Re sum_k tip_k exp(poles_k t)` [m].

    **Fields**: `poles` [rad/s], and `tip` [m] along x and y for every pole, at the end of
    the move; leading axes of both are the members of a batch, such as payloads.
    """

    poles: Complex[Array, "*batch modes"]
    tip: Complex[Array, "*batch 2 modes"]


def free_motion(arm: Arm, controller: AbstractController, move: Move) -> FreeMotion:
    """What `move` leaves behind in the loop of `arm` and `controller`, linear about the end of the move.

    From rest at the start of the move. The integral `int exp(A (T - t)) B u(t) dt` is
    taken mode by mode between the knots of the move. Not for use under `jit`: the loop is
    taken apart into its eigenvectors.
    """
    poles, into, out = _modal(arm, controller, jnp.stack(move.stop))

    def deviation(t):
        setpoint = move.setpoint(t)
        value = [v - r for v, r in zip(setpoint.value, move.stop, strict=True)]
        return jnp.stack([*value, *setpoint.rate, *setpoint.acceleration])

    places, weights = np.polynomial.legendre.leggauss(NODES)
    knots = move.jumps()
    low, width = knots[:-1, None], jnp.diff(knots)[:, None]
    times = (low + width * (jnp.asarray(places) + 1) / 2).ravel()
    shares = (width / 2 * jnp.asarray(weights)).ravel()
    pushed = into @ jax.jit(jax.vmap(deviation))(times).T
    end = move.end()
    state = -into @ deviation(knots[0]) / poles * jnp.exp(poles * (end - knots[0]))
    state = state + jnp.sum(shares * jnp.exp(poles[:, None] * (end - times)) * pushed, axis=1)
    return FreeMotion(poles, out * state)


def step_motion(
    arm: Arm, controller: AbstractController, start: Float[Array, " joints"], stop: Float[Array, " joints"]
) -> FreeMotion:
    """The tip after the reference jumps from `start` to `stop` [rad], linear about `stop`; see `free_motion`."""
    poles, into, out = _modal(arm, controller, stop)
    joints = stop.shape[0]
    return FreeMotion(poles, out * (-into[:, :joints] @ (start - stop).astype(into.dtype) / poles))


def _modal(
    arm: Arm, controller: AbstractController, rest: Float[Array, " joints"]
) -> tuple[Array, Array, Array]:
    """Poles of the closed loop, what its inputs do to each mode, and what each does to the tip."""
    loop = linearise(arm, rest, controller, ("tip_x", "tip_y"))
    poles, vectors = jnp.linalg.eig(loop.A)
    return poles, jnp.linalg.solve(vectors, loop.B.astype(vectors.dtype)), loop.C @ vectors


def stack_motions(motions: Sequence[FreeMotion]) -> FreeMotion:
    """One batch of several motions, such as those with each payload."""
    return jax.tree_util.tree_map(lambda *leaves: jnp.stack(leaves), *motions)


def tip_after(motion: FreeMotion, shaper: Shaper, times: Float[Array, " times"]) -> Float[Array, "times 2"]:
    """Tip about its resting place [m] at `times` [s] from the end of the shaped move on."""
    since = shaper.duration() - shaper.delays
    state = motion.tip * (shaper.amplitudes @ jnp.exp(since[:, None] * motion.poles))
    return jnp.real(jnp.exp(times[:, None] * motion.poles) @ state.T)


def shaped_residual(motion: FreeMotion, shaper: Shaper, times: Float[Array, " times"]) -> Scalar:
    """`residual_vibration` [m] of the tip over `times` [s] after the end of the shaped move."""
    return residual_vibration(times, tip_after(motion, shaper, times), times[0], jnp.zeros(2))


class TunedShaper(NamedTuple):
    """The outcome of `tune_shaper`: the best `shaper`, its `worst` residual [m], and those of all starts."""

    shaper: Shaper
    worst: Scalar
    from_starts: Float[Array, " starts"]


def _values(free: Float[Array, " free"], impulses: int, duration: Scalar) -> Shaper:
    amplitudes = Simplex().value(free[: impulses - 1])
    return Shaper(amplitudes, Delays(duration).value(free[impulses - 1 :]))


def tune_shaper(
    motions: FreeMotion,
    duration: ScalarLike,
    times: Float[Array, " times"],
    impulses: int = 8,
    starts: int = 8,
    max_steps: int = 400,
    seed: int = 0,
) -> TunedShaper:
    """The shaper of `duration` [s] with the least worst residual over the batch `motions`.

    The first start has equal gaps and binomial amplitudes, the others are scattered about
    it; all are followed down at once by BFGS, at powers of the mean from 8 to 2048, each
    with a barrier that fades as the power grows.
    `times` [s]: the instants after the move at which the tip is watched.
    """
    return _tuned(motions, scalar(duration), times, impulses, starts, max_steps, seed)


@eqx.filter_jit
def _tuned(motions, length, times, impulses, starts, max_steps, seed) -> TunedShaper:
    binomial = jnp.ones(1)
    for _ in range(impulses - 1):
        binomial = jnp.convolve(binomial, jnp.full(2, 0.5))
    first = jnp.concatenate(
        [Simplex().free(binomial), Delays(length).free(length * jnp.linspace(0.0, 1.0, impulses))]
    )
    scatter = jax.random.normal(jax.random.key(seed), (starts - 1, first.shape[0]), first.dtype)
    points = jnp.concatenate([first[None], first + scatter])

    def paths(free):
        shaper = _values(free, impulses, length)
        return jax.vmap(lambda motion: tip_after(motion, shaper, times))(motions)

    def worst(free):
        shaper = _values(free, impulses, length)
        return jnp.max(jax.vmap(lambda motion: shaped_residual(motion, shaper, times))(motions))

    def cost(free, power):
        away = paths(free)
        scale = jax.lax.stop_gradient(jnp.max(jnp.abs(away)))
        sides = jnp.stack([away, -away]) / scale
        # log-sum-exp over instants, rest included: a smooth form of each side's largest excursion
        tops = jax.nn.logsumexp(power * jnp.pad(sides, ((0, 0), (0, 0), (0, 1), (0, 0))), axis=2) / power
        boxes = jnp.sqrt(jnp.sum(jnp.sum(tops, axis=0) ** 2, axis=-1))
        made = _values(free, impulses, length)
        gaps = jnp.diff(made.delays) / length
        # amplitudes and gaps that went to zero early would have no slope to come back by
        inside = -jnp.sum(jnp.log(made.amplitudes)) - jnp.sum(jnp.log(gaps))
        return jax.nn.logsumexp(power * boxes) / power * scale / reference + INSIDE / power * inside

    def at_power(free, power):
        solver = optx.BFGS(rtol=1e-9, atol=1e-9)
        found = optx.minimise(cost, solver, free, args=power, max_steps=max_steps, throw=False)
        return found.value, None

    def descend(free):
        free = jax.lax.scan(at_power, free, jnp.asarray(POWERS))[0]
        return free, worst(free)

    reference = jax.lax.stop_gradient(worst(first))
    found, residuals = jax.vmap(descend)(points)
    best = jnp.argmin(jnp.where(jnp.isfinite(residuals), residuals, jnp.inf))
    return TunedShaper(_values(found[best], impulses, length), residuals[best], residuals)
