"""The arm between two samples, and a recording cut into short pieces of it.

State x of a piece: coordinates, rates, currents, heat of the windings, and what each
instrument shows (an instrument may lag). Every piece starts from a state of its own, so
that all run side by side, none drifts away from what was measured, and one program
serves every horizon: long runs are pieces joined end to end by linear algebra.
"""

# arrays of numpy go to JAX and come back, which its annotations do not foresee
# pyright: reportArgumentType=false, reportOptionalMemberAccess=false

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..arm.arm import AssembledArm
from ..drive import drive, drive_effects, effect_torques, has_current_state, joint_effects
from ..dynamics.lagrange import accelerations
from ..dynamics.simplify import simplified
from ..effects import AbstractDryFriction, WindingHeating
from ..scalars import Scalar
from ..sensors import read_channels
from .dry_friction import Stepping, dry_friction


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
    """What pieces show, `(pieces, samples, channels)`, the state each ends in, and those on the way."""

    reading: Float[Array, "*more samples channels"]
    end: Float[Array, "*more states"]
    states: Float[Array, "*more samples states"] | None = None


def state_size(model: AssembledArm, channels: tuple[str, ...]) -> int:
    """Number of states of a piece."""
    currents = sum(has_current_state(model, i) for i in range(len(model.joints)))
    return 2 * model.size + currents + len(model.joints) + len(channels)


def _split(model: AssembledArm, x: tuple):
    n, joints = model.size, len(model.joints)
    currents = sum(has_current_state(model, i) for i in range(joints))
    rest = 2 * n + currents
    return x[:n], x[n : 2 * n], x[2 * n : rest], x[rest : rest + joints], x[rest + joints :]


def _drives(model: AssembledArm, command: tuple, qd: tuple, currents: tuple, heat: tuple):
    memory = tuple(
        heat[effect.index] if isinstance(effect, WindingHeating) else None for effect in drive_effects(model)
    )
    rates, _ = model.split(qd)
    return drive(model, command, currents, rates, memory)


def _motion(model: AssembledArm, t: Scalar, x: tuple, command: tuple, force: tuple):
    """Drives and accelerations at an instant, dry friction left to `force`."""
    q, qd, currents, heat, _ = _split(model, x)
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
    """`x'`, instruments left where they are; tuples of scalars, which a batch turns into vectors."""
    _, qd, _, heat, shown = _split(model, x)
    drives, qdd = _motion(model, t, x, command, force)
    warming = [jnp.zeros_like(t)] * len(model.joints)
    for effect in drive_effects(model):
        if isinstance(effect, WindingHeating):
            i = effect.index
            warming[i] = effect.rate(command[i], drives.current[i], model.joints[i].motor, heat[i])
    return (*qd, *qdd, *drives.current_rate, *warming, *(jnp.zeros_like(y) for y in shown))


def truth(
    model: AssembledArm, channels: tuple[str, ...], t: Scalar, x: tuple, command: tuple, friction: tuple
) -> tuple:
    """What perfect instruments would show, under the dry friction of every joint."""
    q, qd, currents, heat, _ = _split(model, x)
    if any(name.startswith("tip_acceleration") for name in channels):
        elastic = (jnp.zeros_like(t),) * (model.size - len(friction))
        drives, qdd = _motion(model, t, x, command, (*friction, *elastic))
    else:
        drives, qdd = _drives(model, command, qd, currents, heat), None
    found = read_channels(model, q, qd, drives, qdd)
    return tuple(found[name] for name in channels)


def run_piece(
    model: AssembledArm,
    instruments: Instruments,
    channels: tuple[str, ...],
    start: Float[Array, " states"],
    command: Float[Array, "samples joints"],
    force: Float[Array, "samples coordinates"],
    time: Float[Array, " samples"],
    sample_time: float,
    stepping: Stepping,
) -> Response:
    """One piece from `start`, by classical Runge-Kutta steps.

    `force`: on every coordinate beside all else, held over each interval.
    """
    h = sample_time / stepping.substeps
    some = instruments.lag > 0
    safe = jnp.where(some, instruments.lag, 1.0)
    decay = tuple(jnp.where(some, jnp.exp(-sample_time / safe), 0.0))
    mean = tuple(jnp.where(some, 1 - jnp.exp(-sample_time / safe), 1.0) * instruments.lag / sample_time)
    gain, bias, drift = (tuple(part) for part in instruments[:3])
    count, joints = len(channels), len(model.joints)

    def moved(x, slope, by):
        return tuple(a + by * b for a, b in zip(x, slope, strict=True))

    def step(carry, inputs):
        x, friction = carry
        u, f, t = inputs
        before = truth(model, channels, t, x, u, friction)
        shown = x[-count:]
        reading = tuple(g * y + b + d * t for g, y, b, d in zip(gain, shown, bias, drift, strict=True))

        def one_pass(y, dry):
            total = (*(a + b for a, b in zip(f, dry, strict=False)), *f[joints:])

            def stage(carry, weights):
                # classical Runge-Kutta as a scan over its stages, which compiles once for all four
                z, slope, mean = carry
                ahead, share = weights
                slope = derivative(model, t + ahead * h, moved(z, slope, ahead * h), u, total)
                return (z, slope, moved(mean, slope, share)), None

            zero = tuple(jnp.zeros_like(v) for v in y)
            weights = (jnp.array([0.0, 0.5, 0.5, 1.0]), jnp.array([1.0, 2.0, 2.0, 1.0]) / 6)
            (_, _, slope), _ = jax.lax.scan(stage, (y, zero, zero), weights)
            return moved(y, slope, h)

        def substep(_, carry):
            y, _ = carry

            def again(_, carry):
                _, _, agreed = carry
                end = one_pass(y, agreed)
                starts, ends = (model.split(z[model.size : 2 * model.size])[0] for z in (y, end))
                return end, agreed, dry_friction(model, stepping, starts, ends, agreed, h)

            none = (jnp.zeros_like(h),) * joints
            end, dry, _ = jax.lax.fori_loop(0, stepping.passes, again, (y, none, none))
            return end, dry

        y, friction = jax.lax.fori_loop(0, stepping.substeps, substep, (x, friction))
        after = truth(model, channels, t + sample_time, y, u, friction)
        lagged = tuple(
            a * s + (m - a) * b + (1 - m) * c
            for a, s, m, b, c in zip(decay, shown, mean, before, after, strict=True)
        )
        return ((*y[:-count], *lagged), friction), (reading, x)

    inputs = (tuple(command.T), tuple(force.T), time)
    still = (jnp.zeros_like(time[0]),) * joints
    (end, _), (reading, states) = jax.lax.scan(step, (tuple(start), still), inputs)
    return Response(jnp.stack(reading, -1), jnp.stack(end), jnp.stack(states, -1))


def _lanes(model, instruments, channels, starts, force, pieces: Pieces) -> Response:
    def one(start, command, force, time):
        return run_piece(
            model, instruments, channels, start, command, force, time, pieces.sample_time, pieces.stepping
        )

    return jax.vmap(one)(starts, pieces.command, force, pieces.time)


@eqx.filter_jit
def respond(
    model: AssembledArm,
    instruments: Instruments,
    channels: tuple[str, ...],
    starts: Float[Array, "pieces states"],
    pieces: Pieces,
) -> Response:
    """Every piece from its own start."""
    force = jnp.zeros((*pieces.time.shape, model.size))
    return _lanes(model, instruments, channels, starts, force, pieces)


class Direction(NamedTuple):
    """What is moved: leaves of the model, instruments, starts, commands, forces."""

    model: Any
    instruments: Instruments
    start: Float[Array, "*more states"]
    command: Float[Array, "*more samples joints"]
    force: Float[Array, "*more samples coordinates"]


@eqx.filter_jit
def slopes(
    model: AssembledArm,
    instruments: Instruments,
    channels: tuple[str, ...],
    starts: Float[Array, "pieces states"],
    pieces: Pieces,
    directions: Direction,
) -> Response:
    """Derivative of `respond` along each of `directions`, leading axis first."""
    arrays, static = eqx.partition(model, eqx.is_inexact_array)
    force = jnp.zeros((*pieces.time.shape, model.size))

    def run(arrays, instruments, starts, command, force):
        moved = eqx.tree_at(lambda p: p.command, pieces, command)
        return _lanes(eqx.combine(arrays, static), instruments, channels, starts, force, moved)

    point = (arrays, instruments, starts, pieces.command, force)

    def along(direction):
        start = jnp.broadcast_to(direction.start, starts.shape)
        tangent = (direction.model, direction.instruments, start, direction.command, direction.force)
        moved = jax.jvp(run, point, tangent)[1]
        return Response(moved.reading, moved.end)

    return jax.vmap(along)(directions)
