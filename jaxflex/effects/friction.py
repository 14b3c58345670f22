"""Friction at a joint beyond the viscous term: torques that depend on its rate."""

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp

from ..scalars import Scalar, scalar
from .base import AbstractJointEffect

TRANSITION_RATE = 0.01  # rad/s over which the sign of a rate is smoothed, unless told


def smooth_sign(rate: Scalar, transition_rate: Scalar) -> Scalar:
    """`tanh(rate / transition_rate)`: the sign of a rate, differentiable at rest."""
    return jnp.tanh(rate / transition_rate)


class CoulombFriction(AbstractJointEffect):
    """Dry friction `-T_c sign(rate)`: `torque` T_c [N m], `transition_rate` [rad/s]."""

    torque: Scalar = eqx.field(converter=scalar)
    transition_rate: Scalar = eqx.field(converter=scalar, default=TRANSITION_RATE)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "coulomb_friction"

    def __call__(self, angle: Scalar, rate: Scalar) -> Scalar:
        """`-T_c tanh(rate / v_t)` [N m]."""
        return -self.torque * smooth_sign(rate, self.transition_rate)


class StribeckFriction(AbstractJointEffect):
    """Friction that is higher near rest, `-T_s exp(-(rate/v_s)^2) sign(rate)`.

    `torque` T_s [N m] is the excess of breakaway over Coulomb friction, `stribeck_rate`
    v_s [rad/s] where it fades; add a `CoulombFriction` for the level it fades to.
    """

    torque: Scalar = eqx.field(converter=scalar)
    stribeck_rate: Scalar = eqx.field(converter=scalar, default=0.1)
    transition_rate: Scalar = eqx.field(converter=scalar, default=TRANSITION_RATE)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "stribeck_friction"

    def __call__(self, angle: Scalar, rate: Scalar) -> Scalar:
        """`-T_s exp(-(rate / v_s)^2) tanh(rate / v_t)` [N m]."""
        fade = jnp.exp(-((rate / self.stribeck_rate) ** 2))
        return -self.torque * fade * smooth_sign(rate, self.transition_rate)


class AsymmetricFriction(AbstractJointEffect):
    """Dry friction that differs with direction: `-T_a` while turning either way, `torque` T_a [N m].

    Forward motion feels T_a more, backward motion T_a less than the symmetric friction
    it is added to; at rest it vanishes, unlike a load torque.
    """

    torque: Scalar = eqx.field(converter=scalar)
    transition_rate: Scalar = eqx.field(converter=scalar, default=TRANSITION_RATE)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "asymmetric_friction"

    def __call__(self, angle: Scalar, rate: Scalar) -> Scalar:
        """`-T_a tanh(rate / v_t)^2` [N m]."""
        return -self.torque * smooth_sign(rate, self.transition_rate) ** 2


class QuadraticDrag(AbstractJointEffect):
    """Drag `-c rate |rate|`: `coefficient` c [N m s^2/rad^2]."""

    coefficient: Scalar = eqx.field(converter=scalar)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "quadratic_drag"

    def __call__(self, angle: Scalar, rate: Scalar) -> Scalar:
        """`-c rate |rate|` [N m]."""
        return -self.coefficient * rate * jnp.abs(rate)
