"""What instruments on the arm read: the ideal channels, and the instruments' faults."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from .arm.arm import AssembledArm
from .arm.kinematics import poses, velocities
from .beam.link_model import LinkModel
from .brief import brief
from .drive import DriveState
from .effects.sensor import first_order_lag
from .scalars import Scalar, dot, optional_scalar, scalar

UNITS = {
    "time": "s",
    "voltage": "V",
    "current": "A",
    "torque": "N m",
    "angle": "rad",
    "rate": "rad/s",
    "reference": "rad",
    "tip_deflection": "m",
    "strain": "1",
    "tip_acceleration": "m/s^2",
    "tip_x": "m",
    "tip_y": "m",
}


def unit(channel: str) -> str:
    """Unit of a channel such as `angle_1` or `tip_x`; raises `KeyError` for an unknown one."""
    if channel in UNITS:
        return UNITS[channel]
    return UNITS[channel.rpartition("_")[0]]


def channel_names(model: AssembledArm) -> tuple[str, ...]:
    """Every channel the arm has, see `read_channels`."""
    names = []
    for i, joint in enumerate(model.joints, 1):
        names += [f"angle_{i}", f"rate_{i}", f"torque_{i}"]
        if joint.motor is not None:
            names += [f"voltage_{i}", f"current_{i}"]
    for i, link in enumerate(model.arm.links, 1):
        names += [f"tip_deflection_{i}", f"tip_acceleration_{i}"]
        if link.thickness is not None:
            names.append(f"strain_{i}")
    return (*names, "tip_x", "tip_y")


def read_channels(
    model: AssembledArm,
    q: tuple,
    qd: tuple,
    drives: DriveState,
    qdd: tuple | None = None,
) -> dict[str, Scalar]:
    """Every channel of the arm at an instant, without error.

    - `angle_i` [rad] encoder, `rate_i` [rad/s] tachometer, `torque_i` [N m] of the motor
    - `voltage_i` [V], `current_i` [A] where joint i has a motor
    - `tip_deflection_i` [m] of link i from its own tangent at the root
    - `strain_i` at the gauge, `h/2 w''`, where the thickness of link i is known
    - `tip_acceleration_i` [m/s^2], across link i, of its tip in the inertial frame; only
      where the accelerations `qdd` are given
    - `tip_x`, `tip_y` [m] of the payload in the base frame
    """
    angles, etas = model.split(q)
    rates, _ = model.split(qd)
    zero = 0 * angles[0]
    channels: dict[str, Scalar] = {}
    for i, joint in enumerate(model.joints):
        number = i + 1
        channels[f"angle_{number}"] = angles[i]
        channels[f"rate_{number}"] = rates[i]
        channels[f"torque_{number}"] = drives.torque[i]
        if joint.motor is not None:
            channels[f"voltage_{number}"] = drives.voltage[i]
            channels[f"current_{number}"] = drives.current[i]
    for i, link in enumerate(model.arm.links):
        number, constants = i + 1, model.links[i]
        channels[f"tip_deflection_{number}"] = measured_deflection(constants, etas[i]) + zero
        if link.thickness is not None:
            curvature = dot(constants.gauge_curvature, etas[i])
            channels[f"strain_{number}"] = link.thickness / 2 * curvature
    end = poses(model, q)[1][-1]
    channels["tip_x"] = end.x + zero
    channels["tip_y"] = end.y + zero
    if qdd is not None:
        for i, value in enumerate(tip_accelerations(model, q, qd, qdd), 1):
            channels[f"tip_acceleration_{i}"] = value
    return channels


def measured_deflection(link: LinkModel, eta: tuple) -> Scalar:
    """Tip deflection [m] from the tangent at the hub, or past the spring of a flexible joint.

    What its instrument shows of it: of a gauge, its bending by the scale of a weight at the tip.
    """
    if link.shown is not None:
        return dot(link.shown, eta)  # pyright: ignore
    return dot(link.tip_deflection, eta) - link.length * dot(link.joint_twist, eta)  # pyright: ignore


def tip_accelerations(model: AssembledArm, q: tuple, qd: tuple, qdd: tuple) -> list[Scalar]:
    """Acceleration [m/s^2] of every link's tip in the inertial frame, across the link.

    The velocity along the link's axes, differentiated in time, plus what the turning of
    those axes adds.
    """

    def motion(q, qd):
        return velocities(model, q, qd)

    (frames, tips), (_, tip_slopes) = jax.jvp(motion, (q, qd), (qd, qdd))
    count = len(model.arm.links)
    return [tip_slopes[i].y + frames[i].rate * tips[i].x for i in range(count)]


def quantised(signal: Float[Array, "*times"] | float, step: Scalar) -> Float[Array, "*times"]:
    """`signal` rounded to whole multiples of `step`, as it is where that is zero.

    Rounding passes the gradient through unchanged.
    """
    some = step > 0
    size = jnp.where(some, step, 1.0)
    rounded = jnp.where(some, jnp.round(signal / size) * size, signal)
    return signal + jax.lax.stop_gradient(rounded - signal)


class Sensor(eqx.Module):
    """An instrument with its faults: `gain * lagged(signal) + bias + noise`, then rounded.

    **Fields**: `gain` [1], `bias` [unit of the channel], `lag` [s] of first order,
    `noise` standard deviation [unit], `resolution` [unit] of one count (None: none). An
    encoder of N counts a turn has `resolution = 2 pi / N`.
    """

    gain: Scalar = eqx.field(converter=scalar, default=1.0)
    bias: Scalar = eqx.field(converter=scalar, default=0.0)
    lag: Scalar = eqx.field(converter=scalar, default=0.0)
    noise: Scalar = eqx.field(converter=scalar, default=0.0)
    resolution: Scalar | None = eqx.field(converter=optional_scalar, default=None)

    __repr__ = brief

    def read(
        self,
        times: Float[Array, " times"],
        signal: Float[Array, " times"],
        key: PRNGKeyArray | None = None,
    ) -> Float[Array, " times"]:
        """What the instrument shows of `signal` at `times` [s]; without a `key`, no noise.

        Rounding to counts passes the gradient through unchanged.
        """
        reading = self.gain * first_order_lag(times, signal, self.lag) + self.bias
        if key is not None:
            reading = reading + self.noise * jax.random.normal(key, signal.shape, signal.dtype)
        return reading if self.resolution is None else quantised(reading, self.resolution)
