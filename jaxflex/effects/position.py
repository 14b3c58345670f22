"""Torques at a joint that depend on its angle, on time, or on nothing."""

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp

from ..scalars import Scalar, scalar
from .base import AbstractJointEffect


class CableStiffness(AbstractJointEffect):
    """A cable or hose that pulls the joint back: `-k (angle - angle_0)`.

    `stiffness` k [N m/rad], `rest_angle` [rad].
    """

    stiffness: Scalar = eqx.field(converter=scalar)
    rest_angle: Scalar = eqx.field(converter=scalar, default=0.0)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "cable_stiffness"
    place: ClassVar[str] = "joint"
    units: ClassVar[dict[str, str]] = {"stiffness": "N m/rad", "rest_angle": "rad"}
    looks_like: ClassVar[str] = "a torque that falls along a straight line over the angle"

    def __call__(self, angle: Scalar, rate: Scalar, time: Scalar) -> Scalar:
        """`-k (angle - angle_0)` [N m]."""
        return -self.stiffness * (angle - self.rest_angle)


class CoggingTorque(AbstractJointEffect):
    """Torque ripple of the magnets, `-(a sin(n angle) + b cos(n angle))`.

    `sine`, `cosine` a, b [N m]; `order` n, periods a turn of the joint.
    """

    sine: Scalar = eqx.field(converter=scalar)
    cosine: Scalar = eqx.field(converter=scalar, default=0.0)
    order: Scalar = eqx.field(converter=scalar, default=12.0)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "cogging_torque"
    place: ClassVar[str] = "joint"
    units: ClassVar[dict[str, str]] = {"sine": "N m", "cosine": "N m", "order": "1"}
    looks_like: ClassVar[str] = "a torque that waves several times a turn over the angle"

    def __call__(self, angle: Scalar, rate: Scalar, time: Scalar) -> Scalar:
        """`-(a sin(n angle) + b cos(n angle))` [N m]."""
        phase = self.order * angle
        return -(self.sine * jnp.sin(phase) + self.cosine * jnp.cos(phase))


class LoadTorqueBias(AbstractJointEffect):
    """A constant load on the joint: `-T_0`, `torque` T_0 [N m]."""

    torque: Scalar = eqx.field(converter=scalar)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "load_torque_bias"
    place: ClassVar[str] = "joint"
    units: ClassVar[dict[str, str]] = {"torque": "N m"}
    looks_like: ClassVar[str] = "a torque that is the same at every angle, speed and time"

    def __call__(self, angle: Scalar, rate: Scalar, time: Scalar) -> Scalar:
        """`-T_0` [N m]."""
        return -self.torque


class PeriodicDisturbance(AbstractJointEffect):
    """A torque from outside that repeats, `a sin(2 pi f t) + b cos(2 pi f t)`.

    `sine`, `cosine` a, b [N m]; `frequency` f [Hz].
    """

    sine: Scalar = eqx.field(converter=scalar)
    cosine: Scalar = eqx.field(converter=scalar, default=0.0)
    frequency: Scalar = eqx.field(converter=scalar, default=1.0)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "periodic_disturbance"
    place: ClassVar[str] = "joint"
    units: ClassVar[dict[str, str]] = {"sine": "N m", "cosine": "N m", "frequency": "Hz"}
    looks_like: ClassVar[str] = "a torque of one steady frequency, whatever the arm does"

    def __call__(self, angle: Scalar, rate: Scalar, time: Scalar) -> Scalar:
        """`a sin(2 pi f t) + b cos(2 pi f t)` [N m]."""
        phase = 2 * jnp.pi * self.frequency * time
        return self.sine * jnp.sin(phase) + self.cosine * jnp.cos(phase)
