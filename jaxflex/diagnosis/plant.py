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
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..arm.arm import AssembledArm
from ..drive import DriveState, drive, drive_effects, effect_torques, has_current_state, joint_effects
from ..dynamics.lagrange import accelerations, inertial_forces
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


def push_size(model: AssembledArm) -> int:
    """Number of coordinates, and of currents that are states: what a push acts on."""
    return state_size(model, ()) - 2 * len(model.joints) - model.size


def bristles(model: AssembledArm) -> slice:
    """Where in the state of a piece the bristles of dry friction are."""
    first = state_size(model, ()) - len(model.joints)
    return slice(first, first + len(model.joints))


def heats(model: AssembledArm) -> slice:
    """Where in the state of a piece the heat of the windings is."""
    first = bristles(model).start - len(model.joints)
    return slice(first, first + len(model.joints))


def twist_place(model: AssembledArm, joint: int) -> int:
    """Which coordinate is what lies between motor and link of a joint that is loose."""
    return len(model.joints) + sum(link.shapes for link in model.links[: joint + 1]) - 1


def hidden_loads(model: AssembledArm) -> list[int]:
    """Where in the state of a piece the loads behind loose joints are, and their rates, where nothing bends.

    No reading shows such a load but by what it does to the motor.
    """
    hidden = [joint for joint, link in enumerate(model.links) if link.loose and link.shapes == 1]
    twists = [twist_place(model, joint) for joint in hidden]
    return [*twists, *(model.size + twist for twist in twists)]


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


def _forces(model: AssembledArm, t: Scalar, x: tuple, command: tuple, force: tuple):
    """Drives, and what acts on every coordinate, at an instant; dry friction left to `force`."""
    q, qd, currents, heat, _, _ = _split(model, x)
    drives = _drives(model, command, qd, currents, heat)
    angles, _ = model.split(q)
    rates, _ = model.split(qd)
    smooth = tuple(e for e in joint_effects(model) if not isinstance(e, AbstractDryFriction))
    extra = effect_torques(smooth, angles, rates, t)
    torques = tuple(a + b for a, b in zip(drives.torque, extra, strict=True))
    zero = jnp.zeros_like(q[0])
    torques = torques + (zero,) * (model.size - len(torques))
    return drives, tuple(
        tau + f - d * v for tau, f, d, v in zip(torques, force, model.damping(q), qd, strict=True)
    )


def _motion(model: AssembledArm, t: Scalar, x: tuple, command: tuple, force: tuple):
    """Drives and accelerations at an instant, dry friction left to `force`."""
    drives, total = _forces(model, t, x, command, force)
    return drives, accelerations(model, *_split(model, x)[:2], total)


def _friction(model: AssembledArm, x: tuple) -> tuple:
    """Dry friction on every coordinate, as its bristles are bent."""
    _, qd, _, _, bends, _ = _split(model, x)
    elastic = (jnp.zeros_like(qd[0]),) * (model.size - len(bends))
    return (*friction_at(model, model.split(qd)[0], bends), *elastic)


def _warming(model: AssembledArm, command: tuple, drives: DriveState, heat: tuple) -> tuple:
    """Power that heats every winding [W]."""
    warming = [jnp.zeros_like(h) for h in heat]
    for effect in drive_effects(model):
        if isinstance(effect, WindingHeating):
            i = effect.index
            warming[i] = effect.rate(command[i], drives.current[i], model.joints[i].motor, heat[i])
    return tuple(warming)


@simplified
def derivative(model: AssembledArm, t: Scalar, x: tuple, command: tuple, push: tuple) -> tuple:
    """`x'`, bristles and instruments left where they are; tuples of scalars, which a batch turns into vectors.

    `push`: what acts beside all else, a force on every coordinate and a change of every current [A/s].
    """
    _, qd, _, heat, bends, shown = _split(model, x)
    drives, qdd = _motion(model, t, x, command, push[: model.size])
    changes = (a + b for a, b in zip(drives.current_rate, push[model.size :], strict=True))
    warming = _warming(model, command, drives, heat)
    return (*qd, *qdd, *changes, *warming, *(jnp.zeros_like(y) for y in (*bends, *shown)))


@simplified
def imbalance(model: AssembledArm, t: Scalar, x: tuple, command: tuple, qdd: tuple) -> tuple:
    """What is left of the forces under the accelerations `qdd`, how currents change, and the power that heats."""
    q, qd, _, heat, _, _ = _split(model, x)
    drives, total = _forces(model, t, x, command, _friction(model, x))
    left = (f - i for f, i in zip(total, inertial_forces(model, q, qd, qdd), strict=True))
    return (*left, *drives.current_rate, *_warming(model, command, drives, heat))


def truth(model: AssembledArm, channels: tuple[str, ...], t: Scalar, x: tuple, command: tuple) -> tuple:
    """What perfect instruments would show."""
    q, qd, currents, heat, _, _ = _split(model, x)
    if any(name.startswith("tip_acceleration") for name in channels):
        drives, qdd = _motion(model, t, x, command, _friction(model, x))
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
    push: tuple,
    t: Scalar,
) -> tuple[tuple, tuple, tuple]:
    """From one sample to the next by classical Runge-Kutta steps; `x` without the instruments.

    `push`: what acts beside all else, held.

    **Returns** the state, and what perfect instruments show at both ends.
    """
    h, joints = sample_time / stepping.substeps, len(model.joints)

    def moved(x, slope, by):
        return tuple(a + by * b for a, b in zip(x, slope, strict=True))

    def one_pass(y, dry):
        total = (*(a + b for a, b in zip(push, dry, strict=False)), *push[joints:])

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
    command, push = (zero,) * len(model.joints), (zero,) * push_size(model)

    def slope(x):
        return jnp.stack(derivative(model, zero, tuple(x), command, push))

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
        none = (jnp.zeros_like(time[0]),) * push_size(model)

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


def mean_motion(
    model: AssembledArm, sample_time: float, x: tuple, end: tuple, command: tuple, t: Scalar
) -> tuple[tuple, tuple]:
    """The state in the mean over an interval, and its accelerations.

    Of coordinates and heat that of the cubic through both ends (Hermite); of rates and accelerations
    what the ends show; of currents that with which they have changed as they did.
    """
    none = (jnp.zeros_like(t),) * push_size(model)
    slopes = derivative(model, t, x, command, none), derivative(model, t + sample_time, end, command, none)
    mean = tuple((a + b) / 2 + sample_time / 12 * (u - v) for a, b, u, v in zip(x, end, *slopes, strict=True))
    gone = tuple((b - a) / sample_time for a, b in zip(x, end, strict=True))
    n = model.size
    rates, (_, _, _, heat, _, _) = gone[:n], _split(model, mean)
    currents, changes = mean[2 * n : n + push_size(model)], gone[2 * n : n + push_size(model)]

    def change(currents):
        return _drives(model, command, rates, currents, heat).current_rate

    now, slope = jax.jvp(change, (currents,), (tuple(map(jnp.ones_like, currents)),))
    currents = tuple(i + (c - a) / b for i, c, a, b in zip(currents, changes, now, slope, strict=True))
    return (*mean[:n], *rates, *currents, *mean[n + push_size(model) :]), gone[n : 2 * n]
