"""The arm between two samples, and a recording cut into short pieces of it.

State x of a piece: coordinates, rates, currents, heat of the windings, how the bristles of
dry friction are bent, and what each instrument shows (an instrument may lag). Every piece
starts from a state of its own, so that all run side by side, none drifts away from what was
measured, and one program serves every horizon: long runs are pieces joined end to end by
linear algebra.
"""

# arrays of numpy go to JAX and come back, which its annotations do not foresee
# pyright: reportArgumentType=false, reportOptionalMemberAccess=false

import math
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..arm.arm import AssembledArm
from ..drive import drive, drive_effects, effect_torques, has_current_state, joint_effects
from ..dynamics.lagrange import accelerations
from ..dynamics.simplify import simplified
from ..effects import AbstractDryFriction, WindingHeating
from ..kept import kept
from ..scalars import Scalar
from ..sensors import read_channels
from .dry_friction import Stepping, dry_friction, friction_at

LIMIT = 1.2  # of |lambda| h of a Runge-Kutta substep


class Instruments(NamedTuple):
    """Faults of the instruments, one entry a channel: `gain y_lagged + bias + drift t`."""

    gain: Float[Array, " channels"]
    bias: Float[Array, " channels"]
    drift: Float[Array, " channels"]
    lag: Float[Array, " channels"]


class Pieces(eqx.Module):
    """Recordings cut into pieces of equal length.

    - `command`: held over each sample interval, `(pieces, samples, joints)`
    - `time` [s] since the start of the run, `(pieces, samples)`
    - `sample_time` [s], the same for all
    """

    command: Float[Array, "pieces samples joints"]
    time: Float[Array, "pieces samples"]
    sample_time: float = eqx.field(static=True)
    stepping: Stepping


class Response(NamedTuple):
    """What pieces show, the state each ends in, and those on the way."""

    reading: Float[Array, "pieces samples channels"]
    end: Float[Array, "pieces states"]
    states: Float[Array, "pieces samples states"]


def state_size(model: AssembledArm, channels: tuple[str, ...]) -> int:
    """Number of states of a piece."""
    currents = sum(has_current_state(model, i) for i in range(len(model.joints)))
    return 2 * model.size + currents + 2 * len(model.joints) + len(channels)


def bristles(model: AssembledArm) -> slice:
    """Where in the state of a piece the bristles of dry friction are."""
    first = state_size(model, ()) - len(model.joints)
    return slice(first, first + len(model.joints))


def _split(model: AssembledArm, x: tuple):
    n, joints, bent = model.size, len(model.joints), bristles(model)
    warm = bent.start - joints
    return x[:n], x[n : 2 * n], x[2 * n : warm], x[warm : bent.start], x[bent], x[bent.stop :]


def _drives(model: AssembledArm, command: tuple, qd: tuple, currents: tuple, heat: tuple):
    memory = tuple(
        heat[effect.index] if isinstance(effect, WindingHeating) else None for effect in drive_effects(model)
    )
    rates, _ = model.split(qd)
    return drive(model, command, currents, rates, memory)


def _motion(model: AssembledArm, t: Scalar, x: tuple, command: tuple, force: tuple):
    """Drives and accelerations at an instant, dry friction left to `force`."""
    q, qd, currents, heat, _, _ = _split(model, x)
    drives = _drives(model, command, qd, currents, heat)
    angles, _ = model.split(q)
    rates, _ = model.split(qd)
    smooth = tuple(e for e in joint_effects(model) if not isinstance(e, AbstractDryFriction))
    extra = effect_torques(smooth, angles, rates, t)
    torques = tuple(a + b for a, b in zip(drives.torque, extra, strict=True))
    zero = jnp.zeros_like(q[0])
    torques = torques + (zero,) * (model.size - len(torques))
    total = tuple(tau + f - d * v for tau, f, d, v in zip(torques, force, model.damping(q), qd, strict=True))
    return drives, accelerations(model, q, qd, total)


@simplified
def derivative(model: AssembledArm, t: Scalar, x: tuple, command: tuple, force: tuple) -> tuple:
    """`x'`, bristles and instruments left where they are; tuples of scalars, which a batch turns into vectors."""
    _, qd, _, heat, bends, shown = _split(model, x)
    drives, qdd = _motion(model, t, x, command, force)
    warming = [jnp.zeros_like(t)] * len(model.joints)
    for effect in drive_effects(model):
        if isinstance(effect, WindingHeating):
            i = effect.index
            warming[i] = effect.rate(command[i], drives.current[i], model.joints[i].motor, heat[i])
    return (*qd, *qdd, *drives.current_rate, *warming, *(jnp.zeros_like(y) for y in (*bends, *shown)))


def truth(model: AssembledArm, channels: tuple[str, ...], t: Scalar, x: tuple, command: tuple) -> tuple:
    """What perfect instruments would show."""
    q, qd, currents, heat, bends, _ = _split(model, x)
    if any(name.startswith("tip_acceleration") for name in channels):
        elastic = (jnp.zeros_like(t),) * (model.size - len(bends))
        friction = friction_at(model, model.split(qd)[0], bends)
        drives, qdd = _motion(model, t, x, command, (*friction, *elastic))
    else:
        drives, qdd = _drives(model, command, qd, currents, heat), None
    found = read_channels(model, q, qd, drives, qdd)
    return tuple(found[name] for name in channels)


def interval(
    model: AssembledArm,
    channels: tuple[str, ...],
    sample_time: float,
    stepping: Stepping,
    x: tuple,
    command: tuple,
    force: tuple,
    t: Scalar,
) -> tuple[tuple, tuple, tuple]:
    """From one sample to the next by classical Runge-Kutta steps; `x` without the instruments.

    `force`: on every coordinate beside all else, held.

    **Returns** the state, and what perfect instruments show at both ends.
    """
    h, joints = sample_time / stepping.substeps, len(model.joints)

    def moved(x, slope, by):
        return tuple(a + by * b for a, b in zip(x, slope, strict=True))

    def one_pass(y, dry):
        total = (*(a + b for a, b in zip(force, dry, strict=False)), *force[joints:])

        def stage(carry, weights):
            # classical Runge-Kutta as a scan over its stages, which compiles once for all four
            z, slope, mean = carry
            ahead, share = weights
            slope = derivative(model, t + ahead * h, moved(z, slope, ahead * h), command, total)
            return (z, slope, moved(mean, slope, share)), None

        zero = tuple(jnp.zeros_like(v) for v in y)
        weights = (jnp.array([0.0, 0.5, 0.5, 1.0]), jnp.array([1.0, 2.0, 2.0, 1.0]) / 6)
        (_, _, slope), _ = jax.lax.scan(stage, (y, zero, zero), weights)
        return moved(y, slope, h)

    none, bent = (jnp.zeros_like(t),) * joints, bristles(model)

    def substep(_, y):
        def again(_, carry):
            _, agreed = carry
            end = one_pass(y, agreed)
            starts, ends = (model.split(z[model.size : 2 * model.size])[0] for z in (y, end))
            friction, bends = dry_friction(model, stepping, starts, ends, y[bent], agreed, h)
            return (*end[: bent.start], *bends, *end[bent.stop :]), friction

        return jax.lax.fori_loop(0, stepping.passes, again, (y, none))[0]

    y = jax.lax.fori_loop(0, stepping.substeps, substep, x)
    return y, truth(model, channels, t, x, command), truth(model, channels, t + sample_time, y, command)


@kept
def _slopes_at_rest(model: AssembledArm) -> Float[Array, "states states"]:
    zero = jnp.zeros(())
    command, force = (zero,) * len(model.joints), (zero,) * model.size

    def slope(x):
        return jnp.stack(derivative(model, zero, tuple(x), command, force))

    return jax.jacfwd(slope)(jnp.zeros(state_size(model, ())))


def substeps_for(model: AssembledArm, sample_time: float) -> int:
    """Runge-Kutta steps in a sample interval that resolve the fastest motion of the arm at rest."""
    slopes = np.asarray(_slopes_at_rest(model))
    if not np.isfinite(slopes).all():
        return 1  # parameters for which there is no motion, whatever the steps
    fastest = float(np.abs(np.linalg.eigvals(slopes)).max())
    return max(1, math.ceil(fastest * sample_time / LIMIT))


class Lag(NamedTuple):
    """How instruments follow: `decay shown + (mean - decay) before + (1 - mean) after`, a channel each."""

    decay: Float[Array, " channels"]
    mean: Float[Array, " channels"]


def lag(time: Float[Array, " channels"], sample_time: float) -> Lag:
    """The instruments' step for lags of first order, exact for readings along a straight line."""
    some = time > 0
    left = jnp.where(some, jnp.exp(-sample_time / jnp.where(some, time, 1.0)), 0.0)
    return Lag(left, (1 - left) * time / sample_time)


@kept
def respond(
    model: AssembledArm,
    instruments: Instruments,
    channels: tuple[str, ...],
    starts: Float[Array, "pieces states"],
    pieces: Pieces,
) -> Response:
    """Every piece from its own start."""
    decay, mean = (tuple(part) for part in lag(instruments.lag, pieces.sample_time))
    gain, bias, drift = (tuple(part) for part in instruments[:3])
    count = len(channels)

    def one(start, command, time):
        none = (jnp.zeros_like(time[0]),) * model.size

        def step(carry, inputs):
            x, shown = carry
            u, t = inputs
            reading = tuple(g * y + b + d * t for g, y, b, d in zip(gain, shown, bias, drift, strict=True))
            y, before, after = interval(model, channels, pieces.sample_time, pieces.stepping, x, u, none, t)
            lagged = tuple(
                a * s + (m - a) * b + (1 - m) * c
                for a, s, m, b, c in zip(decay, shown, mean, before, after, strict=True)
            )
            return (y, lagged), (reading, (*x, *shown))

        (x, shown), found = jax.lax.scan(
            step, (tuple(start)[:-count], tuple(start)[-count:]), (tuple(command.T), time)
        )
        reading, states = (jnp.stack(part, -1) for part in found)
        return Response(reading, jnp.stack((*x, *shown)), states)

    return jax.vmap(one)(starts, pieces.command, pieces.time)


class Moments(NamedTuple):
    """Samples of a run, one after the other: the state there without the instruments, and what acts."""

    x: Float[Array, "moments moving"]
    command: Float[Array, "moments joints"]
    time: Float[Array, " moments"]


class Direction(NamedTuple):
    """What is moved, None for what is not: leaves of the model, states, commands, forces."""

    model: Any = None
    x: Float[Array, "directions moving"] | None = None
    command: Float[Array, "directions joints"] | None = None
    force: Float[Array, "directions coordinates"] | None = None


class Interval(NamedTuple):
    """After an interval: the state, and what perfect instruments show at both ends."""

    x: Float[Array, "*more moments moving"]
    before: Float[Array, "*more moments channels"]
    after: Float[Array, "*more moments channels"]


@kept
def interval_slopes(
    model: AssembledArm,
    channels: tuple[str, ...],
    sample_time: float,
    stepping: Stepping,
    moments: Moments,
    directions: Direction,
) -> tuple[Interval, Interval]:
    """The intervals that begin at `moments`, and their derivatives along each of `directions`, leading axis first."""
    arrays, static = eqx.partition(model, eqx.is_inexact_array)

    def one(arrays, x, command, force, t):
        x, command, force = (tuple(part) for part in (x, command, force))
        moved = eqx.combine(arrays, static)
        found = interval(moved, channels, sample_time, stepping, x, command, force, t)
        return Interval(*(jnp.stack(part) for part in found))

    def run(arrays, x, command, force):
        return jax.vmap(one, (None, 0, 0, None, 0), 0)(arrays, x, command, force, moments.time)

    point = (arrays, moments.x, moments.command, jnp.zeros(model.size))

    def along(direction):
        many = tuple(
            None if part is None else jnp.broadcast_to(part, at.shape)
            for part, at in zip(direction[1:], point[1:], strict=True)
        )
        model = jax.tree.map(lambda _: None, arrays) if direction.model is None else direction.model
        found, moved = eqx.filter_jvp(run, point, (model, *many))
        pairs = zip(found, moved, strict=True)
        return found, Interval(*(jnp.zeros_like(a) if b is None else b for a, b in pairs))

    return jax.vmap(along, out_axes=(None, 0))(directions)
