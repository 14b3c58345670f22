"""The parts of an arm as an engineer describes them: links, joints, payload."""

import dataclasses
from abc import abstractmethod

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool

from ..beam.basis import MODE_SHAPES, Basis, Distal, make_basis
from ..beam.link_model import LinkModel, assumed_modes_link, lumped_link, rigid_link
from ..brief import brief
from ..motor import DCMotor
from ..scalars import Scalar, ScalarLike, optional_scalar, or_zero, scalar


def damping_ratios(value: "ScalarLike | str | tuple[ScalarLike, ...]") -> tuple[Scalar, ...] | str:
    """Modal damping as a tuple of ratios, one a mode, or the word `"ahmad"`."""
    if isinstance(value, str):
        if value != "ahmad":
            raise ValueError(f"damping must be ratios or 'ahmad', not {value!r}.")
        return value
    return tuple(scalar(v) for v in value) if isinstance(value, tuple) else (scalar(value),)


MOTIONS = ("finite", "small")
INSTRUMENTS = ("tip", "gauge")


class AbstractLink(eqx.Module):
    """What an arm asks of a link. Derive from it for one that is not slender or not uniform.

    - `length` [m]
    - `thickness` [m] in the plane of bending, None where no strain is asked for
    - `modes`: number of mode shapes (0: a rigid link)

    The shapes of the links before it are chosen as if its mass were spread evenly.
    """

    length: eqx.AbstractVar[Scalar]
    thickness: eqx.AbstractVar[Scalar | None]
    modes: eqx.AbstractVar[int]

    @property
    @abstractmethod
    def mass(self) -> Scalar:
        """Mass of the link [kg]."""

    @property
    def moves_little(self) -> bool:
        """True if what deflections add to the inertia about the root is left out."""
        return False

    @abstractmethod
    def discretise(self, distal: Distal, carries_link: bool, joint: "Joint") -> LinkModel:
        """The constants of the link between its `joint` and what it carries, `distal`."""


class Link(AbstractLink):
    """A slender uniform link that bends in the plane of motion (Ahmad et al., assumptions I-V).

    **Fields**

    - `length` [m], `mass_per_length` rho [kg/m], `flexural_rigidity` EI [N m^2]
    - `damping_ratio`: modal damping ratio, a tuple with one a mode, or `"ahmad"` for
      `D = 0.1 sqrt(K)`
    - `modes`: number of mode shapes (0: a rigid link)
    - `mode_shapes`: a key of `jaxflex.MODE_SHAPES`; the default is right whether the
      joints are free, locked or controlled
    - `model`: `"assumed_modes"` or `"lumped"`; `segments` of a lumped link
    - `thickness` [m] in the plane of bending, needed for strain alone
    - `gauge_position` [m] of the strain gauge from the root
    - `root_stiffness` [N m/rad] of the `hinged_hub` shapes
    - `root_compliance` [rad/(N m)] of the clamp that holds the link to its hub (None: rigid)
    - `shortening`: share of the shortening by bending that is counted, 1 for all of it
      (centrifugal stiffening); None to leave it out
    - `deflection_from`: what measures the tip's deflection: `"tip"`, or `"gauge"`, a strain gauge
      whose reading was scaled under a weight at the tip, and which higher modes drive all the more
    - `motion`: `"finite"`, or `"small"` to leave out what deflections add to the inertia about
      the root, the one term that makes a single link non-linear (for an arm of one joint)
    """

    length: Scalar = eqx.field(converter=scalar)
    mass_per_length: Scalar = eqx.field(converter=scalar)
    flexural_rigidity: Scalar = eqx.field(converter=scalar)
    damping_ratio: tuple[Scalar, ...] | str = eqx.field(converter=damping_ratios, default=0.0)
    modes: int = eqx.field(static=True, default=2)
    mode_shapes: str = eqx.field(static=True, default="distal_mass_and_moment")
    model: str = eqx.field(static=True, default="assumed_modes")
    segments: int = eqx.field(static=True, default=20)
    thickness: Scalar | None = eqx.field(converter=optional_scalar, default=None)
    gauge_position: Scalar = eqx.field(converter=scalar, default=0.0)
    root_stiffness: Scalar = eqx.field(converter=scalar, default=0.0)
    root_compliance: Scalar | None = eqx.field(converter=optional_scalar, default=None)
    shortening: Scalar | None = eqx.field(converter=optional_scalar, default=None)
    motion: str = eqx.field(static=True, default="finite")
    deflection_from: str = eqx.field(static=True, default="tip")

    __repr__ = brief

    def __check_init__(self):
        if self.modes < 0:
            raise ValueError(f"a link needs modes >= 0, found {self.modes}.")
        if self.motion not in MOTIONS:
            raise ValueError(f"motion = {self.motion!r} is unknown; allowed are {', '.join(MOTIONS)}.")
        if self.deflection_from not in INSTRUMENTS:
            raise ValueError(
                f"deflection_from = {self.deflection_from!r} is unknown; allowed are {', '.join(INSTRUMENTS)}."
            )
        if self.model not in ("assumed_modes", "lumped"):
            raise ValueError(f"model = {self.model!r} is unknown; allowed are assumed_modes, lumped.")
        if self.mode_shapes not in MODE_SHAPES:
            allowed = ", ".join(MODE_SHAPES)
            raise ValueError(f"mode_shapes = {self.mode_shapes!r} is unknown; allowed are {allowed}.")

    @classmethod
    def from_rectangle(
        cls,
        length: ScalarLike,
        width: ScalarLike,
        thickness: ScalarLike,
        youngs_modulus: ScalarLike,
        density: ScalarLike,
        **options,
    ) -> "Link":
        """A link of rectangular section: `rho = density w h`, `EI = E w h^3 / 12`.

        `width` [m] across the plane of bending, `thickness` h [m] in it,
        `youngs_modulus` [Pa], `density` [kg/m^3]; `options` as for `Link`.
        """
        h = scalar(thickness)
        return cls(
            length=length,
            mass_per_length=scalar(density) * scalar(width) * h,
            flexural_rigidity=scalar(youngs_modulus) * scalar(width) * h**3 / 12,
            thickness=h,
            **options,
        )

    @property
    def moves_little(self) -> bool:
        """True of `motion = "small"`."""
        return self.motion == "small"

    @property
    def mass(self) -> Scalar:
        """Mass of the link [kg]."""
        return self.mass_per_length * self.length

    def basis(self, distal: Distal, carries_link: bool, joint_compliance: ScalarLike | None = None) -> Basis:
        """The deflection shapes of an assumed-modes link with `distal` at its ends."""
        return make_basis(
            self.mode_shapes, self.modes, self.length, self.mass_per_length,
            self.flexural_rigidity, distal, carries_link, or_zero(self.root_compliance) + or_zero(joint_compliance),
        )  # fmt: skip

    def discretise(self, distal: Distal, carries_link: bool, joint: "Joint") -> LinkModel:
        """The constants of the link, its shapes chosen for what hangs on it."""
        model = self._constants(distal, carries_link, joint)
        if self.deflection_from == "tip":
            return model
        # under a force F at the tip the gauge bends by F (l - x) / EI, and the tip by F l^3 / 3 EI
        lever = self.length**3 / (3 * (self.length - self.gauge_position))
        return dataclasses.replace(model, shown=tuple(lever * bend for bend in model.gauge_curvature))

    def _shortening(self, joint: "Joint") -> Scalar | None:
        """The share of bending in it; None if neither bending nor a turn of the root takes off any length."""
        turns = any(part is not None for part in (joint.play, joint.compliance, self.root_compliance))
        if self.shortening is None and turns and not self.moves_little:
            return scalar(0.0)
        return self.shortening

    def _constants(self, distal: Distal, carries_link: bool, joint: "Joint") -> LinkModel:
        if self.modes == 0:
            keeps_length = self._shortening(joint) is not None
            return rigid_link(self.length, self.mass, joint.play is not None, keeps_length)
        if self.model == "lumped":
            if joint.play is not None:
                raise ValueError(
                    "a lumped link has no play at its root: use model = 'assumed_modes', or no play."
                )
            return lumped_link(
                self.length, self.mass_per_length, self.flexural_rigidity,
                self.damping_ratio, self.gauge_position, self.segments, None, distal.mass,
                or_zero(self.root_compliance), or_zero(joint.compliance),
            )  # fmt: skip
        return assumed_modes_link(
            self.basis(distal, carries_link, joint.compliance), self.mass_per_length,
            self.flexural_rigidity, self.damping_ratio, self.gauge_position,
            or_zero(joint.compliance), self._shortening(joint), joint.play is not None,
        )  # fmt: skip


class Joint(eqx.Module):
    """A revolute joint and what turns with it.

    **Fields** (shape `()`)

    - `hub_inertia` J_h [kg m^2], turning at the absolute rate of the link it drives
    - `hub_mass` M_h [kg] at the joint, carried by the link before it
    - `viscous_friction` b [N m s/rad] on the joint's rate
    - `rotor_inertia` I_r [kg m^2], turning at the gear ratio times the joint's rate
      (Ahmad et al. (7))
    - `motor`: a `DCMotor`, or None for a joint driven by a torque
    - `compliance` [rad/(N m)] of the spring between motor and link, which follows at once
      (None: rigid); the hub inertia stays on the motor's side, and so do the joint's angle and rate
    - `play` [rad] between motor and link (None: they are one), `contact_stiffness`
      [N m/rad] and `contact_damping` [N m s/rad] of its flanks; without a gap these are a
      spring and a damper. Of the hub inertia `motor_share` stays on the motor's side
    """

    hub_inertia: Scalar = eqx.field(converter=scalar, default=0.0)
    hub_mass: Scalar = eqx.field(converter=scalar, default=0.0)
    viscous_friction: Scalar = eqx.field(converter=scalar, default=0.0)
    rotor_inertia: Scalar = eqx.field(converter=scalar, default=0.0)
    motor: DCMotor | None = None
    compliance: Scalar | None = eqx.field(converter=optional_scalar, default=None)
    play: Scalar | None = eqx.field(converter=optional_scalar, default=None)
    contact_stiffness: Scalar | None = eqx.field(converter=optional_scalar, default=None)
    contact_damping: Scalar = eqx.field(converter=scalar, default=0.0)
    motor_share: Scalar = eqx.field(converter=scalar, default=1.0)

    __repr__ = brief

    @property
    def clearance(self) -> Scalar:
        """Half the play [rad]."""
        return scalar(0.0 if self.play is None else self.play / 2)

    def pressed(self, twist: Scalar) -> Scalar:
        """How far [rad] the flanks of the play are pressed together at a `twist` of the link, signed."""
        return jnp.where(self.touches(twist), twist - jnp.sign(twist) * self.clearance, 0.0)

    def touches(self, twist: Scalar) -> Bool[Array, ""]:
        """True if the link has turned through the play to one of its flanks."""
        return jnp.abs(twist) >= self.clearance

    @property
    def reflected_inertia(self) -> Scalar:
        """`G^2 I_r` [kg m^2]: the rotor as the joint feels it."""
        ratio = scalar(1.0) if self.motor is None else self.motor.gear_ratio
        return ratio**2 * self.rotor_inertia


class Payload(eqx.Module):
    """A rigid body at the tip: `mass` M_p [kg], `inertia` I_p [kg m^2] about the tip."""

    mass: Scalar = eqx.field(converter=scalar, default=0.0)
    inertia: Scalar = eqx.field(converter=scalar, default=0.0)

    __repr__ = brief
