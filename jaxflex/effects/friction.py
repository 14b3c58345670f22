"""Friction at a joint beyond the viscous term: torques that depend on its rate.

Dry friction follows the sign of the rate. Rigid, it changes within a narrow band of rates;
with `presliding`, the surfaces first bend against each other over so many radians and then
slide, as those of real bearings and brushes do.
"""

from abc import abstractmethod
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import PyTree

from ..scalars import Scalar, optional_scalar, scalar
from .base import AbstractJointEffect

TRANSITION_RATE = 0.01  # rad/s over which the sign of a rate is smoothed, unless told
SMALL = 1e-3  # of an argument whose quotient with its tanh is taken from a series


def smooth_sign(rate: Scalar, transition_rate: Scalar) -> Scalar:
    """`tanh(rate / transition_rate)`: the sign of a rate, differentiable at rest."""
    return jnp.tanh(rate / transition_rate)


def smooth_size(rate: Scalar, transition_rate: Scalar) -> Scalar:
    """`rate / smooth_sign(rate)`: the size of a rate, no less than `transition_rate`."""
    x = rate / transition_rate
    small = jnp.abs(x) < SMALL
    safe = jnp.where(small, 1.0, x)
    return transition_rate * jnp.where(small, 1 + x * x / 3, safe / jnp.tanh(safe))


def fading(x: Scalar, tail: Scalar) -> Scalar:
    """`(1 + p x^2)^(-1/p)` with `tail` p: from 1 at rest to 0, `exp(-x^2)` for p = 0."""
    w = tail * x * x
    small = jnp.abs(w) < SMALL
    safe = jnp.where(small, 1.0, w)
    return jnp.exp(-x * x * jnp.where(small, 1 - w / 2 + w * w / 3, jnp.log1p(safe) / safe))


class AbstractDryFriction(AbstractJointEffect):
    """Friction `-T(rate, z) z` that changes sign with the rate; z is that sign, made smooth.

    - Rigid, where `presliding` is None: `z = tanh(rate / v_t)`, `transition_rate` v_t [rad/s].
    - A bristle (Dahl 1968; Canudas de Wit et al. 1995) that bends over `presliding` s [rad]:
      `z' = (rate - |rate| z) / s`, with `|rate|` smoothed such that z goes to the rigid law
      where the rate lasts. It is a state of its own, and stiff: it settles at `|rate| / s`.
      Damped, `-T (z + d z')`: `bristle_damping` d [s] is its damping by its stiffness.
    """

    transition_rate: eqx.AbstractVar[Scalar]
    presliding: eqx.AbstractVar[Scalar | None]
    bristle_damping: eqx.AbstractVar[Scalar]

    @abstractmethod
    def resistance(self, rate: Scalar, side: Scalar | float) -> Scalar:
        """Torque T [N m] against sliding at the speed `rate`, forwards (`side` 1) or backwards (-1)."""

    def initial(self) -> PyTree:
        """A bristle that is not bent, None for a rigid law."""
        return None if self.presliding is None else jnp.zeros_like(self.presliding)

    def settling(self, rate: Scalar) -> Scalar:
        """How fast a bristle settles [1/s], `|rate| / s`."""
        assert self.presliding is not None
        return smooth_size(rate, self.transition_rate) / self.presliding

    def memory_rate(self, rate: Scalar, memory: PyTree) -> PyTree:
        """`z'` [1/s] of the bristle."""
        if self.presliding is None:
            return None
        return rate / self.presliding - self.settling(rate) * memory

    def __call__(self, angle: Scalar, rate: Scalar, time: Scalar, memory: PyTree = None) -> Scalar:
        """`-T(rate, z) (z + d z')` [N m], z the memory or, without, the smooth sign of the rate."""
        if memory is None:
            side = smooth_sign(rate, self.transition_rate)
            return -self.resistance(rate, side) * side
        grip = memory + self.bristle_damping * self.memory_rate(rate, memory)
        return -self.resistance(rate, memory) * grip


class CoulombFriction(AbstractDryFriction):
    """Dry friction `-T_c sign(rate)`: `torque` T_c [N m].

    `transition_rate` [rad/s], `presliding` [rad] and `bristle_damping` [s] say how its sign changes, see
    `AbstractDryFriction`.
    """

    torque: Scalar = eqx.field(converter=scalar)
    transition_rate: Scalar = eqx.field(converter=scalar, default=TRANSITION_RATE)
    presliding: Scalar | None = eqx.field(converter=optional_scalar, default=None)
    bristle_damping: Scalar = eqx.field(converter=scalar, default=0.0)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "coulomb_friction"
    place: ClassVar[str] = "joint"
    units: ClassVar[dict[str, str]] = {
        "torque": "N m",
        "transition_rate": "rad/s",
        "presliding": "rad",
        "bristle_damping": "s",
    }
    looks_like: ClassVar[str] = "a torque that jumps as the joint changes direction and is flat in between"

    def resistance(self, rate: Scalar, side: Scalar | float) -> Scalar:
        """`T_c` [N m]."""
        return self.torque


class StribeckFriction(AbstractDryFriction):
    """Dry friction that is higher near rest, `-(T_c + T_s f(rate/v_s)) sign(rate)`.

    `torque` T_s [N m] is the excess of breakaway over the `level` T_c [N m] that it fades
    to, `stribeck_rate` v_s [rad/s] where it fades, as `f(x) = (1 + p x^2)^(-1/p)` with `tail` p [1]: 0 for
    `exp(-x^2)` (Armstrong-Helouvry et al. 1994), 1 for `1/(1 + x^2)` (Hess and Soom 1990); the rest as for
    `CoulombFriction`.
    """

    torque: Scalar = eqx.field(converter=scalar)
    level: Scalar = eqx.field(converter=scalar, default=0.0)
    stribeck_rate: Scalar = eqx.field(converter=scalar, default=0.1)
    transition_rate: Scalar = eqx.field(converter=scalar, default=TRANSITION_RATE)
    presliding: Scalar | None = eqx.field(converter=optional_scalar, default=None)
    bristle_damping: Scalar = eqx.field(converter=scalar, default=0.0)
    tail: Scalar = eqx.field(converter=scalar, default=0.0)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "stribeck_friction"
    place: ClassVar[str] = "joint"
    units: ClassVar[dict[str, str]] = {
        "torque": "N m",
        "level": "N m",
        "stribeck_rate": "rad/s",
        "transition_rate": "rad/s",
        "presliding": "rad",
        "bristle_damping": "s",
        "tail": "1",
    }
    looks_like: ClassVar[str] = "a torque against motion that peaks near rest and fades with speed"

    def resistance(self, rate: Scalar, side: Scalar | float) -> Scalar:
        """`T_c + T_s f(rate / v_s)` [N m]."""
        return self.level + self.torque * fading(rate / self.stribeck_rate, self.tail)


class AsymmetricFriction(AbstractDryFriction):
    """Dry friction that differs with direction: `-T_a` while turning either way, `torque` T_a [N m].

    Forward motion feels T_a more, backward motion T_a less than the symmetric friction
    it is added to; at rest it vanishes, unlike a load torque. The rest as for `CoulombFriction`.
    """

    torque: Scalar = eqx.field(converter=scalar)
    transition_rate: Scalar = eqx.field(converter=scalar, default=TRANSITION_RATE)
    presliding: Scalar | None = eqx.field(converter=optional_scalar, default=None)
    bristle_damping: Scalar = eqx.field(converter=scalar, default=0.0)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "asymmetric_friction"
    place: ClassVar[str] = "joint"
    units: ClassVar[dict[str, str]] = {
        "torque": "N m",
        "transition_rate": "rad/s",
        "presliding": "rad",
        "bristle_damping": "s",
    }
    looks_like: ClassVar[str] = "a torque of one sign while the joint turns either way, gone at rest"

    def resistance(self, rate: Scalar, side: Scalar | float) -> Scalar:
        """`T_a` forwards, `-T_a` backwards [N m]."""
        return side * self.torque


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
