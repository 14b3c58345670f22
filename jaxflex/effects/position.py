"""Torques at a joint that depend on its angle, or on nothing."""

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

    def __call__(self, angle: Scalar, rate: Scalar) -> Scalar:
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

    def __call__(self, angle: Scalar, rate: Scalar) -> Scalar:
        """`-(a sin(n angle) + b cos(n angle))` [N m]."""
        phase = self.order * angle
        return -(self.sine * jnp.sin(phase) + self.cosine * jnp.cos(phase))


class LoadTorqueBias(AbstractJointEffect):
    """A constant load on the joint: `-T_0`, `torque` T_0 [N m]."""

    torque: Scalar = eqx.field(converter=scalar)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "load_torque_bias"

    def __call__(self, angle: Scalar, rate: Scalar) -> Scalar:
        """`-T_0` [N m]."""
        return -self.torque
