"""Slopes of sample intervals: by what they begin with and what acts, or by what makes up for a change of the arm."""

# arrays of numpy go to JAX and come back, which its annotations do not foresee
# pyright: reportArgumentType=false

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..arm.arm import AssembledArm
from ..kept import kept
from .dry_friction import Stepping
from .plant import imbalance, interval, mean_motion, push_size, truth


class Moments(NamedTuple):
    """Samples of a run, one after the other: the state there and at the next without the instruments, and what acts."""

    x: Float[Array, "moments moving"]
    end: Float[Array, "moments moving"]
    command: Float[Array, "moments joints"]
    time: Float[Array, " moments"]


class Direction(NamedTuple):
    """What is moved, None for what is not: leaves of the model, states, commands, what is pushed."""

    model: Any = None
    x: Float[Array, "directions moving"] | None = None
    command: Float[Array, "directions joints"] | None = None
    push: Float[Array, "directions pushes"] | None = None


class Interval(NamedTuple):
    """Slopes of an interval: of the state after it, and of what perfect instruments show at both ends."""

    x: Float[Array, "directions moments moving"]
    before: Float[Array, "directions moments channels"]
    after: Float[Array, "directions moments channels"]


@kept
def interval_slopes(
    model: AssembledArm,
    channels: tuple[str, ...],
    sample_time: float,
    stepping: Stepping,
    moments: Moments,
    directions: Direction,
) -> Interval:
    """Derivatives of the intervals that begin at `moments` along each of `directions`."""
    arrays, static = eqx.partition(model, eqx.is_inexact_array)

    def one(arrays, x, command, push, t):
        x, command, push = (tuple(part) for part in (x, command, push))
        moved = eqx.combine(arrays, static)
        found = interval(moved, channels, sample_time, stepping, x, command, push, t)
        return tuple(jnp.stack(part) for part in found)

    def run(arrays, x, command, push):
        return jax.vmap(one, (None, 0, 0, None, 0), 0)(arrays, x, command, push, moments.time)

    point = (arrays, moments.x, moments.command, jnp.zeros(push_size(model)))

    def along(direction):
        many = tuple(
            None if part is None else jnp.broadcast_to(part, at.shape)
            for part, at in zip(direction[1:], point[1:], strict=True)
        )
        model = jax.tree.map(lambda _: None, arrays) if direction.model is None else direction.model
        return _filled(*eqx.filter_jvp(run, point, (model, *many)))

    return Interval(*jax.vmap(along)(directions))


def _filled(point: tuple, slopes: tuple) -> tuple:
    """The slopes, zero where there is none."""
    return tuple(jnp.zeros_like(a) if b is None else b for a, b in zip(point, slopes, strict=True))


class Imbalance(NamedTuple):
    """A push that does in an interval what a change of the model does; heating, and readings at both ends."""

    push: Float[Array, "directions moments pushes"]
    heating: Float[Array, "directions moments joints"]
    before: Float[Array, "directions moments channels"]
    after: Float[Array, "directions moments channels"]


@kept
def imbalance_slopes(
    model: AssembledArm,
    channels: tuple[str, ...],
    sample_time: float,
    moments: Moments,
    directions: Any,
) -> Imbalance:
    """What the model's leaves, moved along each of `directions`, do in the intervals that begin at `moments`."""
    arrays, static = eqx.partition(model, eqx.is_inexact_array)
    joints = len(model.joints)

    def mean(moment):
        x, end, command = (tuple(part) for part in moment[:3])
        found = mean_motion(model, sample_time, x, end, command, moment.time)
        return tuple(jnp.stack(part) for part in found)

    def one(arrays, motion, moment):
        x, end, command = (tuple(part) for part in moment[:3])
        t, moved = moment.time, eqx.combine(arrays, static)
        between, qdd = (tuple(part) for part in motion)
        left = imbalance(moved, t + sample_time / 2, between, command, qdd)
        readings = (
            truth(moved, channels, t, x, command),
            truth(moved, channels, t + sample_time, end, command),
        )
        return tuple(jnp.stack(part) for part in (left[:-joints], left[-joints:], *readings))

    motion = jax.vmap(mean)(moments)

    def run(arrays):
        return jax.vmap(one, (None, 0, 0))(arrays, motion, moments)

    def along(direction):
        return _filled(*eqx.filter_jvp(run, (arrays,), (direction,)))

    return Imbalance(*jax.vmap(along)(directions))


@kept
def true_readings(
    model: AssembledArm, channels: tuple[str, ...], sample_time: float, moments: Moments
) -> tuple[Float[Array, "one moments channels"], Float[Array, "one moments channels"]]:
    """What perfect instruments show at both ends of the intervals that begin at `moments`."""

    def one(moment):
        x, end, command = (tuple(part) for part in moment[:3])
        before = truth(model, channels, moment.time, x, command)
        after = truth(model, channels, moment.time + sample_time, end, command)
        return jnp.stack(before), jnp.stack(after)

    before, after = jax.vmap(one)(moments)
    return before[None], after[None]
