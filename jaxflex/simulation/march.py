"""Steps of equal length from one instant that matters to the next.

The instants are the times wanted and the jumps of reference and disturbance; between two of
them steps are of equal length, no longer than asked for. What comes of it against a general
solver: a batch goes through one short loop that the compiler fuses whole, and the time of a
jump has its true derivative, since the steps before and after it stretch with it.
"""

import equinox.internal as eqxi
import jax
import jax.numpy as jnp
import jax.tree_util as jtu
from jaxtyping import Array, Float, Int

from ..scalars import Scalar
from .plant import Plant, State, derivative, within
from .rosenbrock import LinearlyImplicit, rosenbrock_step
from .runge_kutta import RungeKutta4

CHECKPOINTS = 32  # states kept between two instants for going backwards
SLACK = 1e-9  # share of a step by which an interval may exceed a whole number of them
ROUNDING = 8  # units in the last place by which the time of a jump may be off


def march(
    plant: Plant,
    start: State,
    times: Float[Array, " times"],
    jumps: Float[Array, " jumps"],
    dt: Scalar,
    max_steps: int,
    backwards: bool,
    solver: RungeKutta4 | LinearlyImplicit,
) -> tuple[State, Int[Array, ""]]:
    """States at `times` [s] from `start` at the first of them, and how many steps they take.

    No step is longer than `dt` [s]. Where more than `max_steps` would be needed, none are
    taken. `backwards`: keep what reverse mode needs; without, forward mode alone works.
    """
    step = rosenbrock_step if isinstance(solver, LinearlyImplicit) else classical_step
    rounding = ROUNDING * jnp.finfo(times.dtype).eps * jnp.abs(jax.lax.stop_gradient(times)).max()
    inside = _on_times(jnp.clip(jumps, times[0], times[-1]), times, rounding)
    instants = jnp.sort(jnp.concatenate([times, inside]))
    lengths = jnp.diff(instants)
    # a jump at one of the times has an interval of no length, whose step has a derivative nevertheless
    counts = jnp.maximum(jnp.ceil(jax.lax.stop_gradient(lengths / dt) - SLACK), 1).astype(int)
    total = jnp.sum(counts)
    counts = jnp.where(total <= max_steps, counts, 0)

    def interval(state, given):
        begin, end, count = given
        h = (end - begin) / jnp.maximum(count, 1)
        # of a jump at its beginning an interval sees what is after, of one at its end what is before
        seen = jax.lax.stop_gradient((begin + rounding, end - rounding))

        def advance(i, state):
            return step(plant, begin + i * h, h, seen, state)

        loop = _loop_backwards if backwards else _loop
        state = loop(count, advance, state)
        return state, state

    _, after = jax.lax.scan(interval, start, (instants[:-1], instants[1:], counts))
    wanted = jnp.searchsorted(jax.lax.stop_gradient(instants[1:]), jax.lax.stop_gradient(times[1:]))
    saved = jtu.tree_map(lambda first, rest: jnp.concatenate([first[None], rest[wanted]]), start, after)
    return saved, total


def _on_times(jumps: Float[Array, " jumps"], times: Float[Array, " times"], rounding: Scalar) -> Array:
    """Jumps that miss one of `times` by no more than `rounding` moved onto it, their derivatives kept."""
    given, known = jax.lax.stop_gradient((jumps, times))
    after = jnp.clip(jnp.searchsorted(known, given), 1, times.shape[0] - 1)
    lower, upper = known[after - 1], known[after]
    nearest = jnp.where(given - lower < upper - given, lower, upper)
    return jumps + jnp.where(jnp.abs(given - nearest) <= rounding, nearest - given, 0.0)


def classical_step(plant: Plant, t: Scalar, h: Scalar, seen: tuple, state: State) -> State:
    """One step of `h` [s] from `t` (Kutta 1901), of whose input only what is within `seen` is read."""

    def moved(a, slope, by):
        return jtu.tree_map(lambda x, s: x + by * s, a, slope)

    def stage(carry, weights):
        # a scan, so that one program serves the four stages
        slope, total = carry
        ahead, share = weights
        slope = derivative(within(seen, t + ahead * h), moved(state, slope, ahead * h), plant)
        return (slope, moved(total, slope, share)), None

    zero = jtu.tree_map(jnp.zeros_like, state)
    weights = (jnp.array([0.0, 0.5, 0.5, 1.0]), jnp.array([1.0, 2.0, 2.0, 1.0]) / 6)
    (_, total), _ = jax.lax.scan(stage, (zero, zero), weights)
    return moved(state, total, h)


def _loop(count: Int[Array, ""], advance, state: State) -> State:
    return jax.lax.fori_loop(0, count, advance, state)


def _loop_backwards(count: Int[Array, ""], advance, state: State) -> State:
    def body(carry):
        i, state = carry
        return i + 1, advance(i, state)

    _, state = eqxi.while_loop(
        lambda carry: carry[0] < count,
        body,
        (jnp.zeros((), int), state),
        kind="checkpointed",
        checkpoints=CHECKPOINTS,
    )
    return state
