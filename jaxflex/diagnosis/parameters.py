"""Every number the diagnosis may move: the arm's nominal parameters, and each effect at zero.

All effects of the catalogue sit in one arm from the start, absent until a parameter of
theirs is raised. One structure then serves every hypothesis, and is compiled once.
"""

import dataclasses
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..arm.arm import Arm
from ..dynamics.lagrange import mass_matrix
from ..effects import (
    EFFECTS,
    AbstractDryFriction,
    AbstractEffect,
    AbstractSensorEffect,
    AsymmetricFriction,
    InputDelay,
)
from ..files.arm_file import ArmFile

# what these do is done to the command and to the readings, not inside the arm
OUTSIDE = (InputDelay, AbstractSensorEffect)

CONTACT = ("contact_stiffness", "contact_damping", "motor_share")
BRISTLE = ("presliding", "bristle_damping", "transition_rate")  # how dry friction changes its sign
DEFAULT_UNCERTAINTY = 0.05  # relative, where an arm file says nothing


@dataclass(frozen=True)
class Nominal:
    """A nominal parameter: its value is `value exp(spread z)`, with z of unit variance a priori.

    `leaves` of the arm go with powers of it: `(path, power)`.
    """

    name: str
    value: float
    spread: float
    leaves: tuple[tuple[Callable[[Any], Any], int], ...]

    @property
    def is_of_contact(self) -> bool:
        """True of what happens between the flanks of a loose joint: nobody states it, a guess stands for it."""
        return self.name.startswith(CONTACT)


@dataclass(frozen=True)
class EffectParameter:
    """Parameter `field` of the effect at `index` in the arm (None: outside of it); `value` where absent."""

    index: int | None
    effect: str
    location: str
    field: str
    unit: str
    value: float

    @property
    def name(self) -> str:
        """`coulomb_friction at joint_1: torque`."""
        return f"{self.effect} at {self.location}: {self.field}"


class Parameters:
    """The vector that the diagnosis works on, and the arm it stands for.

    `vector` holds z of every nominal parameter, then the value of every effect parameter.
    """

    def __init__(self, file: ArmFile, effects: Sequence[AbstractEffect]):
        self.nominal = tuple(_nominal(file))
        inside = [effect for effect in effects if not isinstance(effect, OUTSIDE)]
        self.arm = dataclasses.replace(file.arm, effects=(*file.arm.effects, *inside))
        places = {id(e): len(file.arm.effects) + i for i, e in enumerate(inside)}
        self.effects = tuple(effects)
        self.effect = tuple(
            EffectParameter(
                places.get(id(effect)), effect.name, effect.location, field, unit,
                float(getattr(effect, field)),
            )
            for effect in effects
            for field, unit in effect.units.items()
        )  # fmt: skip
        model = self.arm.assemble()
        inverse = jnp.linalg.inv(mass_matrix(model, jnp.zeros(model.size)))
        self.lightness = np.array([float(inverse[i, i]) for i in range(len(file.arm.joints))])
        self._stated = len(file.arm.effects)
        self._always_dry = any(isinstance(effect, AbstractDryFriction) for effect in file.arm.effects)
        self.start = np.array([0.0] * len(self.nominal) + [part.value for part in self.effect])

    @property
    def names(self) -> list[str]:
        """Name of every entry of the vector."""
        return [part.name for part in (*self.nominal, *self.effect)]

    def position(self, effect: str, location: str, field: str) -> int:
        """Where in the vector a parameter of an effect is."""
        for i, part in enumerate(self.effect):
            if (part.effect, part.location, part.field) == (effect, location, field):
                return len(self.nominal) + i
        raise KeyError(f"no parameter {field!r} of {effect!r} at {location!r}.")

    def bends_bristles(self, column: int) -> bool:
        """True of a parameter by which the bristles of dry friction bend otherwise, and not only push harder."""
        first = len(self.nominal)
        return column >= first and self.effect[column - first].field in BRISTLE

    def has_dry_friction(self, vector: np.ndarray) -> bool:
        """True if some joint has friction that changes sign with the rate."""
        return self._always_dry or any(
            value != 0
            for part, value in zip(self.effect, vector[len(self.nominal) :], strict=True)
            if issubclass(EFFECTS[part.effect], AbstractDryFriction) and part.field in ("torque", "level")
        )

    def has_what_it_changes(self, key: tuple[str, str], there: Collection[tuple[str, str]]) -> bool:
        """False of an asymmetry of dry friction at a joint that has none, neither stated nor among effects `there`.

        Both are (effect, location).
        """
        effect, location = key
        if not issubclass(EFFECTS[effect], AsymmetricFriction):
            return True
        stated = {(own.name, own.location) for own in self.arm.effects[: self._stated]}
        return any(
            issubclass(EFFECTS[name], AbstractDryFriction) and where == location
            for name, where in stated.union(there)
        )

    def gives_way(self, link: int) -> float:
        """How far a force at its tip turns a link about its root, by its first shape [rad/(N m)].

        Of a beam `L / (3 E I)`.
        """
        own = self.arm.assemble().links[link]
        return float(own.tip_deflection[0] ** 2 / (own.stiffness[0] * own.length**2))

    @property
    def plays(self) -> dict[int, int]:
        """Places of the gaps of the joints that are loose, by joint."""
        return {
            joint: self.position("backlash", f"joint_{joint + 1}", "gap")
            for joint, own in enumerate(self.arm.joints)
            if own.play is not None
        }

    def build(self, vector: Float[Array, " parameters"]) -> Arm:
        """The arm with the parameters of `vector`; differentiable."""
        moved: dict[int, tuple[Callable[[Any], Any], Any]] = {}
        for i, part in enumerate(self.nominal):
            for path, power in part.leaves:
                key = id(path(self.arm))
                value = moved[key][1] if key in moved else path(self.arm)
                moved[key] = (path, value * jnp.exp(power * part.spread * vector[i]))
        first = len(self.nominal)
        for j, part in enumerate(self.effect):
            if part.index is not None:
                moved[-1 - j] = (_field(part.index, part.field), vector[first + j])
        paths = [path for path, _ in moved.values()]
        return eqx.tree_at(
            lambda a: [path(a) for path in paths], self.arm, [value for _, value in moved.values()]
        )


def _field(index: int, field: str) -> Callable[[Any], Any]:
    return lambda arm: getattr(arm.effects[index], field)


def _nominal(file: ArmFile) -> list[Nominal]:
    """The positive parameters of the arm with their uncertainty; those at zero are not there."""
    arm, found = file.arm, []
    default = file.uncertainty.get("default", DEFAULT_UNCERTAINTY)

    def add(name, keys, value, leaves):
        spread = next((file.uncertainty[key] for key in keys if key in file.uncertainty), default)
        if value is not None and float(value) > 0 and spread > 0:
            found.append(Nominal(name, float(value), spread, tuple(leaves)))

    for i, link in enumerate(arm.links):
        tail = f"_{i + 1}" if len(arm.links) > 1 else ""

        def at(field, i=i):
            return lambda a: getattr(a.links[i], field)

        add(f"length{tail}", ["length"], link.length, [(at("length"), 1)])
        section = file.sections[i] if i < len(file.sections) else None
        mass, bend = at("mass_per_length"), at("flexural_rigidity")
        if section is not None:
            powers = {
                "width": [(mass, 1), (bend, 1)],
                "thickness": [(mass, 1), (bend, 3), (at("thickness"), 1)],
                "youngs_modulus": [(bend, 1)],
                "density": [(mass, 1)],
            }
            for key, leaves in powers.items():
                add(key + tail, [key], section[key], leaves)
        else:
            add(f"mass_per_length{tail}", ["mass_per_length"], link.mass_per_length, [(mass, 1)])
            add(f"flexural_rigidity{tail}", ["flexural_rigidity"], link.flexural_rigidity, [(bend, 1)])
        ratios = link.damping_ratio
        if not isinstance(ratios, str):
            leaves = [(lambda a, i=i, k=k: a.links[i].damping_ratio[k], 1) for k in range(len(ratios))]
            add(f"damping_ratio{tail}", ["damping_ratio"], ratios[0], leaves)
    for i, joint in enumerate(arm.joints):
        tail = f"_{i + 1}" if len(arm.joints) > 1 else ""
        fields = ["hub_inertia", "hub_mass", "viscous_friction", "rotor_inertia"]
        if joint.play is not None:
            fields += CONTACT
        for field in fields:
            if field == "hub_mass" and i == 0:
                continue  # carried by the base
            leaf = (lambda a, i=i, field=field: getattr(a.joints[i], field), 1)
            add(field + tail, [field], getattr(joint, field), [leaf])
        if joint.motor is None or arm.drive == "torque":
            continue
        fields = ["torque_constant"]
        if arm.drive == "voltage":
            fields += ["resistance", "inductance", "back_emf_constant"]
        for field in fields:
            leaf = (lambda a, i=i, field=field: getattr(a.joints[i].motor, field), 1)
            add(field + tail, [field], getattr(joint.motor, field), [leaf])
    if arm.links:
        add("payload_mass", ["payload_mass", "mass"], arm.payload.mass, [(lambda a: a.payload.mass, 1)])
        inertia = (lambda a: a.payload.inertia, 1)
        add("payload_inertia", ["payload_inertia", "inertia"], arm.payload.inertia, [inertia])
    return found
