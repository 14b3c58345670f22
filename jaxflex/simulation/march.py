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
from .plant import Plant, State, derivative
from .rosenbrock import LinearlyImplicit, rosenbrock_step
from .runge_kutta import RungeKutta4

CHECKPOINTS = 32  # states kept between two instants for going backwards
SLACK = 1e-9  # share of a step by which an interval may exceed a whole number of them


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
    inside = jnp.clip(jumps, times[0], times[-1])
    instants = jnp.sort(jnp.concatenate([times, inside]))
    lengths = jnp.diff(instants)
    counts = jnp.ceil(jax.lax.stop_gradient(lengths / dt) - SLACK).astype(int)
    total = jnp.sum(counts)
    counts = jnp.where(total <= max_steps, counts, 0)

    def interval(state, given):
        begin, end, count = given
        h = (end - begin) / jnp.maximum(count, 1)
        # what happens at the end of an interval, such as a jump, is not yet seen
        before = jnp.nextafter(jax.lax.stop_gradient(end), jax.lax.stop_gradient(begin))

        def advance(i, state):
            return step(plant, begin + i * h, h, before, state)

        loop = _loop_backwards if backwards else _loop
        state = loop(count, advance, state)
        return state, state

    _, after = jax.lax.scan(interval, start, (instants[:-1], instants[1:], counts))
    wanted = jnp.searchsorted(jax.lax.stop_gradient(instants[1:]), jax.lax.stop_gradient(times[1:]))
    saved = jtu.tree_map(lambda first, rest: jnp.concatenate([first[None], rest[wanted]]), start, after)
    return saved, total


def classical_step(plant: Plant, t: Scalar, h: Scalar, before: Scalar, state: State) -> State:
    """One step of `h` [s] from `t` (Kutta 1901), nothing seen of what happens after `before`."""

    def moved(a, slope, by):
        return jtu.tree_map(lambda x, s: x + by * s, a, slope)

    def stage(carry, weights):
        # a scan, so that one program serves the four stages
        slope, total = carry
        ahead, share = weights
        now = t + ahead * h
        # its value just before the end, its derivative as it is
        seen = now - jax.lax.stop_gradient(jnp.maximum(now - before, 0.0))
        slope = derivative(seen, moved(state, slope, ahead * h), plant)
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
