"""The arm between two samples, and a recording cut into short pieces of it.

State x of a piece: coordinates, rates, currents, heat of the windings, and what each
instrument shows (an instrument may lag). Every piece starts from a state of its own, so
that all run side by side, none drifts away from what was measured, and one program
serves every horizon: long runs are pieces joined end to end by linear algebra.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..arm.arm import AssembledArm
from ..drive import drive, drive_effects, effect_torques, has_current_state
from ..dynamics.lagrange import accelerations
from ..effects import WindingHeating
from ..scalars import Scalar
from ..sensors import read_channels


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
    - `sample_time` [s], the same for all; `substeps` of the integration in one
    """

    command: Float[Array, "pieces samples joints"]
    time: Float[Array, "pieces samples"]
    sample_time: float = eqx.field(static=True)
    substeps: int = eqx.field(static=True)


class Response(NamedTuple):
    """What pieces show, `(pieces, samples, channels)`, the state each ends in, and those on the way."""

    reading: Float[Array, "*more samples channels"]
    end: Float[Array, "*more states"]
    states: Float[Array, "*more samples states"] | None = None


def state_size(model: AssembledArm, channels: tuple[str, ...]) -> int:
    """Number of states of a piece."""
    currents = sum(has_current_state(model, i) for i in range(len(model.joints)))
    return 2 * model.size + currents + len(model.joints) + len(channels)


def _split(model: AssembledArm, x: Array):
    n, joints = model.size, len(model.joints)
    currents = sum(has_current_state(model, i) for i in range(joints))
    q, qd = tuple(x[:n]), tuple(x[n : 2 * n])
    rest = 2 * n + currents
    return q, qd, tuple(x[2 * n : rest]), tuple(x[rest : rest + joints]), x[rest + joints :]


def _drives(model: AssembledArm, command: Array, qd: tuple, currents: tuple, heat: tuple):
    memory = tuple(
        heat[effect.index] if isinstance(effect, WindingHeating) else None for effect in drive_effects(model)
    )
    rates, _ = model.split(qd)
    return drive(model, tuple(command), currents, rates, memory)


def _motion(model: AssembledArm, t: Scalar, x: Array, command: Array, force: Array):
    """Drives and accelerations at an instant."""
    q, qd, currents, heat, _ = _split(model, x)
    drives = _drives(model, command, qd, currents, heat)
    angles, _ = model.split(q)
    rates, _ = model.split(qd)
    torques = tuple(
        a + b for a, b in zip(drives.torque, effect_torques(model, angles, rates, t), strict=True)
    )
    zero = jnp.zeros_like(q[0])
    torques = torques + (zero,) * (model.size - len(torques))
    total = tuple(
        tau + f - d * v for tau, f, d, v in zip(torques, tuple(force), model.damping(), qd, strict=True)
    )
    return drives, accelerations(model, q, qd, total)


def derivative(model: AssembledArm, t: Scalar, x: Array, command: Array, force: Array) -> Array:
    """`x'`, instruments left where they are."""
    _, qd, _, heat, shown = _split(model, x)
    drives, qdd = _motion(model, t, x, command, force)
    warming = [jnp.zeros_like(t)] * len(model.joints)
    for effect in drive_effects(model):
        if isinstance(effect, WindingHeating):
            i = effect.index
            warming[i] = effect.rate(command[i], drives.current[i], model.joints[i].motor, heat[i])
    return jnp.concatenate(
        [jnp.stack(qd), jnp.stack(qdd), *[jnp.stack([v]) for v in drives.current_rate],
         jnp.stack(warming), jnp.zeros_like(shown)]
    )  # fmt: skip


def truth(model: AssembledArm, channels: tuple[str, ...], t: Scalar, x: Array, command: Array) -> Array:
    """What perfect instruments would show."""
    q, qd, currents, heat, _ = _split(model, x)
    if any(name.startswith("tip_acceleration") for name in channels):
        drives, qdd = _motion(model, t, x, command, jnp.zeros(model.size))
    else:
        drives, qdd = _drives(model, command, qd, currents, heat), None
    found = read_channels(model, q, qd, drives, qdd)
    return jnp.stack([found[name] for name in channels])


def run_piece(
    model: AssembledArm,
    instruments: Instruments,
    channels: tuple[str, ...],
    start: Float[Array, " states"],
    command: Float[Array, "samples joints"],
    force: Float[Array, "samples coordinates"],
    time: Float[Array, " samples"],
    sample_time: float,
    substeps: int,
) -> Response:
    """One piece from `start`, by classical Runge-Kutta steps of `sample_time / substeps`.

    `force`: on every coordinate beside all else, held over each interval.
    """
    h = sample_time / substeps
    some = instruments.lag > 0
    safe = jnp.where(some, instruments.lag, 1.0)
    decay = jnp.where(some, jnp.exp(-sample_time / safe), 0.0)
    mean = jnp.where(some, 1 - decay, 1.0) * instruments.lag / sample_time
    count = len(channels)

    def step(x, inputs):
        u, f, t = inputs
        before = truth(model, channels, t, x, u)
        reading = instruments.gain * x[-count:] + instruments.bias + instruments.drift * t

        def substep(carry, _):
            t, y = carry
            k1 = derivative(model, t, y, u, f)
            k2 = derivative(model, t + h / 2, y + h / 2 * k1, u, f)
            k3 = derivative(model, t + h / 2, y + h / 2 * k2, u, f)
            k4 = derivative(model, t + h, y + h * k3, u, f)
            return (t + h, y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)), None

        (after_t, y), _ = jax.lax.scan(substep, (t, x), None, length=substeps)
        after = truth(model, channels, after_t, y, u)
        shown = decay * x[-count:] + (mean - decay) * before + (1 - mean) * after
        return y.at[-count:].set(shown), (reading, x)

    end, (reading, states) = jax.lax.scan(step, start, (command, force, time))
    return Response(reading, end, states)


def _lanes(model, instruments, channels, starts, force, pieces: Pieces) -> Response:
    def one(start, command, force, time):
        return run_piece(
            model, instruments, channels, start, command, force, time, pieces.sample_time, pieces.substeps
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
