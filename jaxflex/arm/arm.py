"""An arm: links, joints and payload in series, and the same arm with its constants computed."""

import dataclasses
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from ..beam.basis import Distal
from ..beam.link_model import LinkModel, rigid_link
from ..brief import brief
from ..effects import AbstractBodyEffect, AbstractEffect
from ..one_off import one_off
from ..scalars import Scalar, ScalarLike, optional_scalar, scalar
from .parts import AbstractLink, Joint, Link, Payload

DRIVES = ("voltage", "current", "torque")


class Arm(eqx.Module):
    """A planar serial arm of flexible links, horizontal unless gravity is given.

         joint 1     link 1     joint 2     link 2      payload
        (J_h1,b1)==============(J_h2,M_h2)=============[M_p, I_p]
           |  theta_1             theta_2
          base                (relative to the tangent at the tip of link 1)

    **Fields**

    - `links` (each a `Link` or another `AbstractLink`), `joints`: from base to tip; a joint without a
      link is a motor axis with inertia only
    - `payload`: at the tip
    - `gravity` [m/s^2] along -y of the base; None for a horizontal arm
    - `drive`: what the controller commands: `"voltage"`, `"current"` or `"torque"`
    - `effects`: physics beyond the nominal arm, see `jaxflex.EFFECTS`
    - `side_gravity` [m/s^2] along -x of the base, of an arm whose base is tilted

    Deflections are small: the model is linear in the curvature of a link, exact in the
    rotation of the joints. Believe it while tips stay within a tenth of their links and
    joints turn slower than an eighth of the first angular frequency with joints locked;
    with `shortening=1` on the links, up to twice that frequency.
    """

    links: tuple[Any, ...]
    joints: tuple[Joint, ...]
    payload: Payload = eqx.field(default_factory=Payload)
    gravity: Scalar | None = eqx.field(converter=optional_scalar, default=None)
    drive: str = eqx.field(static=True, default="torque")
    effects: tuple[AbstractEffect, ...] = ()
    name: str = eqx.field(static=True, default="arm")
    side_gravity: Scalar | None = eqx.field(converter=optional_scalar, default=None)

    __repr__ = brief

    def __check_init__(self):
        if not self.joints:
            raise ValueError("an arm needs at least one joint.")
        if len(self.links) > len(self.joints):
            raise ValueError(
                f"an arm has a joint at the root of each link: {len(self.links)} links "
                f"need as many joints, found {len(self.joints)}."
            )
        for link in self.links:
            if not isinstance(link, AbstractLink):
                raise ValueError(
                    f"an arm's links are Link or another AbstractLink, not {type(link).__name__}."
                )
        if self.drive not in DRIVES:
            raise ValueError(f"drive = {self.drive!r} is unknown; allowed are {', '.join(DRIVES)}.")
        if self.drive != "torque":
            for number, joint in enumerate(self.joints, 1):
                if joint.motor is None:
                    raise ValueError(
                        f"drive = {self.drive!r} needs a motor at every joint; joint {number} has "
                        "none: give it one or set the drive to 'torque'."
                    )
        for number, (joint, link) in enumerate(zip(self.joints, self.links, strict=False), 1):
            inertia = joint.hub_inertia + joint.reflected_inertia
            chain = isinstance(link, Link) and link.model == "lumped" and link.modes > 0
            if chain and not isinstance(inertia, Tracer) and np.any(inertia == 0):
                raise ValueError(
                    f"joint {number} carries a lumped link and has no inertia: a chain of masses has one spring "
                    "more than masses then, and cannot be solved; give the joint a hub_inertia."
                )
        if len(self.joints) > 1 and any(link.moves_little for link in self.links):
            raise ValueError(
                f"motion = 'small' makes the arm of one joint linear; this one has {len(self.joints)} "
                "joints, whose turning is not: leave it out."
            )
        for effect in self.effects:
            self._check_place(effect)

    def _check_place(self, effect: AbstractEffect) -> None:
        if effect.place in ("tip", "base", "channel"):
            return
        parts = self.links if effect.place == "link" else self.joints
        if effect.index >= len(parts):
            raise ValueError(
                f"effect {effect.name!r} is at {effect.location}, but the arm has "
                f"{len(self.joints)} joint(s) and {len(self.links)} link(s)."
            )
        if effect.place == "motor" and self.joints[effect.index].motor is None:
            raise ValueError(f"effect {effect.name!r} needs a motor at {effect.location}, which has none.")

    def with_payload(self, mass: ScalarLike, inertia: ScalarLike | None = None) -> "Arm":
        """The same arm with another payload mass [kg] and, if given, inertia [kg m^2]."""
        kept = self.payload.inertia if inertia is None else scalar(inertia)
        payload = Payload(mass=scalar(mass), inertia=kept)
        return eqx.tree_at(lambda arm: arm.payload, self, payload)

    def linear(self) -> "Arm":
        """The same arm of one joint in small motion and without a voltage limit, for `Exact()`.

        Effects and gravity stay, so that what they add is linear or not as it is.

        **Raises** `ValueError` for more joints.
        """
        links = tuple(dataclasses.replace(link, motion="small") for link in self.links)
        motors = [
            joint.motor and dataclasses.replace(joint.motor, voltage_limit=None) for joint in self.joints
        ]
        joints = tuple(dataclasses.replace(j, motor=m) for j, m in zip(self.joints, motors, strict=True))
        return dataclasses.replace(self, links=links, joints=joints)

    def distal(self, link: int) -> Distal:
        """What hangs on link `link` with the arm stretched (Ahmad et al. (24)-(25), corrected).

        The inertia is taken about the tip of the link; that of the last link is I_p
        alone (the paper's (25) adds M_p l^2 to it).
        """
        mass, inertia, reach = scalar(0.0), scalar(0.0), scalar(0.0)
        for joint, beyond in zip(self.joints[link + 1 :], self.links[link + 1 :], strict=False):
            mass = mass + joint.hub_mass
            inertia = inertia + joint.hub_inertia + joint.hub_mass * reach**2
            centre = reach + beyond.length / 2
            inertia = inertia + beyond.mass * (centre**2 + beyond.length**2 / 12)
            mass = mass + beyond.mass
            reach = reach + beyond.length
        for joint in self.joints[max(link + 1, len(self.links)) :]:
            mass = mass + joint.hub_mass
            inertia = inertia + joint.hub_inertia + joint.hub_mass * reach**2
        root, own = self.joints[link], self.links[link]
        return Distal(
            mass=mass + self.payload.mass,
            inertia=inertia + self.payload.inertia + self.payload.mass * reach**2,
            hub_inertia=root.hub_inertia + root.reflected_inertia,
            root_stiffness=own.root_stiffness if isinstance(own, Link) else scalar(0.0),
        )

    @one_off
    def assemble(self) -> "AssembledArm":
        """The arm with its body effects applied and every constant of its links computed."""
        arm = self
        for effect in self.effects:
            if isinstance(effect, AbstractBodyEffect):
                arm = effect.apply(arm)
        models = []
        for i, joint in enumerate(arm.joints):
            if i < len(arm.links):
                models.append(arm.links[i].discretise(arm.distal(i), i + 1 < len(arm.links), joint))
            else:
                models.append(rigid_link(scalar(0.0), scalar(0.0), joint.play is not None))
        return AssembledArm(arm, tuple(models))


class AssembledArm(eqx.Module):
    """An arm and the constants of its links: all that the energies need.

    Coordinates are `q = [theta_1 … theta_n, eta_11 …, eta_21 …]`, a tuple of scalars:
    joint angles [rad], then the deflection coordinates [m] link by link.
    """

    arm: Arm
    links: tuple[LinkModel, ...]

    def __repr__(self) -> str:
        return f"AssembledArm({self.arm.name!r}, {self.size} coordinates)"

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The joints from base to tip."""
        return self.arm.joints

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.links) + sum(link.shapes for link in self.links)

    def split(self, q: tuple) -> tuple[tuple, list[tuple]]:
        """Coordinates (or rates) as joint angles, and deflections link by link."""
        n = len(self.links)
        deflections, start = [], n
        for link in self.links:
            deflections.append(tuple(q[start : start + link.shapes]))
            start += link.shapes
        return tuple(q[:n]), deflections

    def stiffness(self) -> tuple[Scalar, ...]:
        """Stiffness of every coordinate at rest: zero for the joints, K_k [N/m] for the links.

        The flanks of a play touch at rest if there is no gap between them.
        """
        found = [jnp.zeros_like(self.joints[0].hub_inertia)] * len(self.links)
        for link, joint in zip(self.links, self.joints, strict=True):
            found += link.stiffness
            if link.loose and joint.contact_stiffness is not None:
                found[-1] = joint.contact_stiffness * joint.touches(jnp.zeros_like(found[-1]))
        return tuple(found)

    def damping(self, q: tuple | None = None) -> tuple[Scalar, ...]:
        """Viscous damping of every coordinate: b [N m s/rad], then D_k [N s/m].

        The flanks of a play damp while they touch, which is a matter of `q` (None: they do).
        """
        found = [joint.viscous_friction for joint in self.joints]
        _, etas = (None, [None] * len(self.links)) if q is None else self.split(q)
        for link, joint, eta in zip(self.links, self.joints, etas, strict=True):
            found += link.damping
            if link.loose:
                touching = 1.0 if eta is None else joint.touches(eta[-1]) * 1.0
                found[-1] = joint.contact_damping * touching
        return tuple(found)
