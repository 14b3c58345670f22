"""Changes of the arm itself: masses, springs and dampers that are not what was said."""

from collections.abc import Callable
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp

from ..scalars import Scalar, scalar
from .base import AbstractBodyEffect


def raised(arm: Any, place: Callable[[Any], Any], by: Scalar) -> Any:
    """The arm with the parameter at `place` higher by so much, from zero where it was absent."""
    own = place(arm)
    value = by if own is None else own + by
    return eqx.tree_at(place, arm, value, is_leaf=lambda x: x is None)


class PayloadMass(AbstractBodyEffect):
    """A payload heavier by `mass` [kg] than was said."""

    mass: Scalar = eqx.field(converter=scalar)
    location: str = eqx.field(static=True, default="tip")
    name: ClassVar[str] = "payload_mass"
    place: ClassVar[str] = "tip"
    units: ClassVar[dict[str, str]] = {"mass": "kg"}
    looks_like: ClassVar[str] = "a force at the tip in proportion to its acceleration, and lower frequencies"

    def apply(self, arm: Any) -> Any:
        """The arm with the payload that it carries."""
        return raised(arm, lambda a: a.payload.mass, self.mass)


class HubInertia(AbstractBodyEffect):
    """A hub that turns harder by `inertia` [kg m^2] than was said."""

    inertia: Scalar = eqx.field(converter=scalar)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "hub_inertia"
    place: ClassVar[str] = "joint"
    units: ClassVar[dict[str, str]] = {"inertia": "kg m^2"}
    looks_like: ClassVar[str] = "a torque in proportion to the joint's acceleration"

    def apply(self, arm: Any) -> Any:
        """The arm with the hub that it has."""
        return raised(arm, lambda a: a.joints[self.index].hub_inertia, self.inertia)


class ViscousFriction(AbstractBodyEffect):
    """Viscous friction of a joint higher by `coefficient` [N m s/rad] than was said."""

    coefficient: Scalar = eqx.field(converter=scalar)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "viscous_friction"
    place: ClassVar[str] = "joint"
    units: ClassVar[dict[str, str]] = {"coefficient": "N m s/rad"}
    looks_like: ClassVar[str] = "a torque that falls along a straight line over the speed"

    def apply(self, arm: Any) -> Any:
        """The arm with the friction that it has."""
        return raised(arm, lambda a: a.joints[self.index].viscous_friction, self.coefficient)


class JointFlexibility(AbstractBodyEffect):
    """A spring between motor and link: `compliance` [rad/(N m)], the inverse of its stiffness.

    The encoder sits on the motor, and the deflection of the link is measured from the
    link's own root. The spring follows at once, unless the joint has a contact stiffness:
    then motor and link move apart, and the spring comes in series with it.
    """

    compliance: Scalar = eqx.field(converter=scalar)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "joint_flexibility"
    place: ClassVar[str] = "joint"
    units: ClassVar[dict[str, str]] = {"compliance": "rad/(N m)"}
    looks_like: ClassVar[str] = "lower frequencies; the joint turns under the link by its moment"

    def apply(self, arm: Any) -> Any:
        """The arm with the spring at its joint."""
        stiffness = arm.joints[self.index].contact_stiffness
        if stiffness is not None:
            softer = stiffness / (1 + stiffness * self.compliance)
            return eqx.tree_at(lambda a: a.joints[self.index].contact_stiffness, arm, softer)
        return raised(arm, lambda a: a.joints[self.index].compliance, self.compliance)


class RootCompliance(AbstractBodyEffect):
    """A clamp that gives way: `compliance` [rad/(N m)] between hub and root of a link.

    The deflection of the link is measured from the hub, the turn of its root included.
    """

    compliance: Scalar = eqx.field(converter=scalar)
    location: str = eqx.field(static=True, default="link_1")
    name: ClassVar[str] = "root_compliance"
    place: ClassVar[str] = "link"
    units: ClassVar[dict[str, str]] = {"compliance": "rad/(N m)"}
    looks_like: ClassVar[str] = "lower frequencies and more deflection for the same root moment"

    def apply(self, arm: Any) -> Any:
        """The arm with the clamp that it has."""
        return raised(arm, lambda a: a.links[self.index].root_compliance, self.compliance)


class StructuralDamping(AbstractBodyEffect):
    """A link whose modal damping ratios are higher by `ratio` than was said."""

    ratio: Scalar = eqx.field(converter=scalar)
    location: str = eqx.field(static=True, default="link_1")
    name: ClassVar[str] = "structural_damping"
    place: ClassVar[str] = "link"
    units: ClassVar[dict[str, str]] = {"ratio": "1"}
    looks_like: ClassVar[str] = "vibration that dies faster or slower than it should"

    def apply(self, arm: Any) -> Any:
        """The arm with the damping that it has."""
        link = arm.links[self.index]
        own = (0.05 / jnp.sqrt(link.mass),) if link.damping_ratio == "ahmad" else link.damping_ratio
        ratios = tuple(ratio + self.ratio for ratio in own)
        return eqx.tree_at(lambda a: a.links[self.index].damping_ratio, arm, ratios)


class CentrifugalStiffening(AbstractBodyEffect):
    """Stiffness of a link that turns: a bent link is shorter, and what turns pulls it straight.

    `share` of the full effect (1: as the kinematics say, `s = 1/2 int w'^2 dx`; 0: absent).
    """

    share: Scalar = eqx.field(converter=scalar)
    location: str = eqx.field(static=True, default="link_1")
    name: ClassVar[str] = "centrifugal_stiffening"
    place: ClassVar[str] = "link"
    units: ClassVar[dict[str, str]] = {"share": "1"}
    looks_like: ClassVar[str] = "a link that is stiffer the faster it turns"

    def apply(self, arm: Any) -> Any:
        """The arm with its links shortened as they bend."""
        return raised(arm, lambda a: a.links[self.index].shortening, self.share)


class Gravity(AbstractBodyEffect):
    """Gravity in the plane of an arm that was said to have less: a tilted base, or a wall mount.

    `along_y`, `along_x` [m/s^2]: what pulls along -y and along -x of the base beside the
    arm's own gravity.
    """

    along_y: Scalar = eqx.field(converter=scalar)
    along_x: Scalar = eqx.field(converter=scalar, default=0.0)
    location: str = eqx.field(static=True, default="base")
    name: ClassVar[str] = "gravity"
    place: ClassVar[str] = "base"
    units: ClassVar[dict[str, str]] = {"along_y": "m/s^2", "along_x": "m/s^2"}
    looks_like: ClassVar[str] = "a torque that goes with the sine and cosine of the angle, and a sag"

    def apply(self, arm: Any) -> Any:
        """The arm with the gravity that acts on it."""
        arm = raised(arm, lambda a: a.gravity, self.along_y)
        return raised(arm, lambda a: a.side_gravity, self.along_x)


class Backlash(AbstractBodyEffect):
    """Play between motor and link: the link's root turns freely over a `gap` [rad], then hits.

    `contact_stiffness` [N m/rad] of the flanks, where the joint has none of its own.
    """

    gap: Scalar = eqx.field(converter=scalar)
    contact_stiffness: Scalar = eqx.field(converter=scalar, default=100.0)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "backlash"
    place: ClassVar[str] = "joint"
    units: ClassVar[dict[str, str]] = {"gap": "rad", "contact_stiffness": "N m/rad"}
    looks_like: ClassVar[str] = "an angle that is lost each time the moment on the joint changes sign"

    def apply(self, arm: Any) -> Any:
        """The arm with play in its joint."""
        arm = raised(arm, lambda a: a.joints[self.index].play, self.gap)
        if arm.joints[self.index].contact_stiffness is not None:
            return arm
        return raised(arm, lambda a: a.joints[self.index].contact_stiffness, self.contact_stiffness)
