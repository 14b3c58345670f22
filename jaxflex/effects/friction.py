"""Friction at a joint beyond the viscous term: torques that depend on its rate."""

from abc import abstractmethod
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp

from ..scalars import Scalar, scalar
from .base import AbstractJointEffect

TRANSITION_RATE = 0.01  # rad/s over which the sign of a rate is smoothed, unless told


def smooth_sign(rate: Scalar, transition_rate: Scalar) -> Scalar:
    """`tanh(rate / transition_rate)`: the sign of a rate, differentiable at rest."""
    return jnp.tanh(rate / transition_rate)


class AbstractDryFriction(AbstractJointEffect):
    """Friction that changes sign with the rate, within a `transition_rate` [rad/s] of rest."""

    transition_rate: eqx.AbstractVar[Scalar]

    @abstractmethod
    def resistance(self, rate: Scalar, side: float) -> Scalar:
        """Torque [N m] against sliding at the speed `rate`, forwards (`side` 1) or backwards (-1)."""


class CoulombFriction(AbstractDryFriction):
    """Dry friction `-T_c sign(rate)`: `torque` T_c [N m], `transition_rate` [rad/s]."""

    torque: Scalar = eqx.field(converter=scalar)
    transition_rate: Scalar = eqx.field(converter=scalar, default=TRANSITION_RATE)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "coulomb_friction"
    place: ClassVar[str] = "joint"
    units: ClassVar[dict[str, str]] = {"torque": "N m", "transition_rate": "rad/s"}
    looks_like: ClassVar[str] = "a torque that jumps as the joint changes direction and is flat in between"

    def resistance(self, rate: Scalar, side: float) -> Scalar:
        """`T_c` [N m]."""
        return self.torque

    def __call__(self, angle: Scalar, rate: Scalar, time: Scalar) -> Scalar:
        """`-T_c tanh(rate / v_t)` [N m]."""
        return -self.torque * smooth_sign(rate, self.transition_rate)


class StribeckFriction(AbstractDryFriction):
    """Dry friction that is higher near rest, `-(T_c + T_s exp(-(rate/v_s)^2)) sign(rate)`.

    `torque` T_s [N m] is the excess of breakaway over the `level` T_c [N m] that it fades
    to, `stribeck_rate` v_s [rad/s] where it fades.
    """

    torque: Scalar = eqx.field(converter=scalar)
    level: Scalar = eqx.field(converter=scalar, default=0.0)
    stribeck_rate: Scalar = eqx.field(converter=scalar, default=0.1)
    transition_rate: Scalar = eqx.field(converter=scalar, default=TRANSITION_RATE)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "stribeck_friction"
    place: ClassVar[str] = "joint"
    units: ClassVar[dict[str, str]] = {
        "torque": "N m",
        "level": "N m",
        "stribeck_rate": "rad/s",
        "transition_rate": "rad/s",
    }
    looks_like: ClassVar[str] = "a torque against motion that peaks near rest and fades with speed"

    def resistance(self, rate: Scalar, side: float) -> Scalar:
        """`T_c + T_s exp(-(rate / v_s)^2)` [N m]."""
        return self.level + self.torque * jnp.exp(-((rate / self.stribeck_rate) ** 2))

    def __call__(self, angle: Scalar, rate: Scalar, time: Scalar) -> Scalar:
        """`-(T_c + T_s exp(-(rate / v_s)^2)) tanh(rate / v_t)` [N m]."""
        return -self.resistance(rate, 1.0) * smooth_sign(rate, self.transition_rate)


class AsymmetricFriction(AbstractDryFriction):
    """Dry friction that differs with direction: `-T_a` while turning either way, `torque` T_a [N m].

    Forward motion feels T_a more, backward motion T_a less than the symmetric friction
    it is added to; at rest it vanishes, unlike a load torque.
    """

    torque: Scalar = eqx.field(converter=scalar)
    transition_rate: Scalar = eqx.field(converter=scalar, default=TRANSITION_RATE)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "asymmetric_friction"
    place: ClassVar[str] = "joint"
    units: ClassVar[dict[str, str]] = {"torque": "N m", "transition_rate": "rad/s"}
    looks_like: ClassVar[str] = "a torque of one sign while the joint turns either way, gone at rest"

    def resistance(self, rate: Scalar, side: float) -> Scalar:
        """`T_a` forwards, `-T_a` backwards [N m]."""
        return side * self.torque

    def __call__(self, angle: Scalar, rate: Scalar, time: Scalar) -> Scalar:
        """`-T_a tanh(rate / v_t)^2` [N m]."""
        return -self.torque * smooth_sign(rate, self.transition_rate) ** 2


class QuadraticDrag(AbstractJointEffect):
    """Drag `-c rate |rate|`: `coefficient` c [N m s^2/rad^2]."""

    coefficient: Scalar = eqx.field(converter=scalar)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "quadratic_drag"
    place: ClassVar[str] = "joint"
    units: ClassVar[dict[str, str]] = {"coefficient": "N m s^2/rad^2"}
    looks_like: ClassVar[str] = "a torque against motion that is a straight line over speed times its size"

    def __call__(self, angle: Scalar, rate: Scalar, time: Scalar) -> Scalar:
        """`-c rate |rate|` [N m]."""
        return -self.coefficient * rate * jnp.abs(rate)
