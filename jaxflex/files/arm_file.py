"""arm.toml: read an arm, with its uncertainty, and write one back."""

import dataclasses
import math
import tomllib
from pathlib import Path
from typing import Any

from ..arm.arm import DRIVES, Arm
from ..arm.parts import INSTRUMENTS, MOTIONS, Joint, Link, Payload
from ..beam.basis import MODE_SHAPES
from ..brief import brief
from ..effects import EFFECTS, AbstractEffect
from ..motor import DCMotor
from ..sensors import UNITS
from .fields import ArmFileError, Fields

SECTION_KEYS = ("width", "thickness", "youngs_modulus", "density")
DIRECT_KEYS = ("mass_per_length", "flexural_rigidity")


@dataclasses.dataclass(frozen=True)
class ArmFile:
    """What an arm file says: the `arm`, and the relative standard deviation of its parameters.

    `uncertainty` maps parameter names to relative standard deviations; the key
    `"default"` stands for all others. `sections` says of each link what its section was
    given as (`width`, `thickness`, `youngs_modulus`, `density`), or None where
    `mass_per_length` and `flexural_rigidity` were. `design` is the `[design]` table that
    `tune` writes beside an arm, or None.
    """

    arm: Arm
    uncertainty: dict[str, float]
    design: dict[str, Any] | None
    sections: tuple[dict[str, float] | None, ...] = ()

    __repr__ = brief


def load_arm(path: str | Path) -> Arm:
    """The arm in the file at `path`; see `read_arm_file`."""
    return read_arm_file(path).arm


def read_arm_file(path: str | Path) -> ArmFile:
    """Read and check an arm file.

    **Raises** `ArmFileError` for a file that cannot be read, an unknown key, or a
    missing or non-physical value: the message names file, key, found and allowed.
    """
    file = str(path)
    try:
        with open(path, "rb") as stream:
            table = tomllib.load(stream)
    except OSError as error:
        raise ArmFileError(f"{file}: cannot be read: {error.strerror}.") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ArmFileError(f"{file}: not valid TOML: {error}.") from error
    return parse_arm(table, file)


def parse_arm(table: dict[str, Any], file: str = "arm") -> ArmFile:
    """The arm that a parsed TOML `table` describes; `file` names it in errors."""
    top = Fields(table, "", file)
    name = top.take("name", Path(file).stem)
    if not isinstance(name, str):
        raise top.fail("name", f"found {name!r}; text in quotes is allowed.")
    gravity = top.number("gravity", 0.0, "a number", lambda x: True)
    side = top.number("side_gravity", None, "a number", lambda x: True)
    tables = _tables(top, "link")
    links = tuple(_link(Fields(part, f"link {i}: ", file)) for i, part in enumerate(tables, 1))
    sections = tuple(
        {key: float(part[key]) for key in SECTION_KEYS} if "youngs_modulus" in part else None
        for part in tables
    )
    joints = tuple(
        _joint(Fields(part, f"joint {i}: ", file), file, i) for i, part in enumerate(_tables(top, "joint"), 1)
    )
    if not joints:
        raise top.fail("joint", "missing; at least one [[joint]] is needed.")
    if len(links) > len(joints):
        raise top.fail(
            "joint", f"found {len(joints)} for {len(links)} links; one [[joint]] a [[link]] is needed."
        )
    payload_fields = Fields(top.take("payload", {}), "payload: ", file)
    payload = Payload(
        mass=payload_fields.not_negative("mass"), inertia=payload_fields.not_negative("inertia")
    )
    payload_fields.finish()
    drive_fields = Fields(top.take("drive", {}), "drive: ", file)
    motors = all(joint.motor is not None for joint in joints)
    drive = drive_fields.choice("input", "voltage" if motors else "torque", DRIVES)
    if drive != "torque" and not motors:
        missing = next(i for i, joint in enumerate(joints, 1) if joint.motor is None)
        raise drive_fields.fail(
            "input",
            f"found {drive!r}, but joint {missing} has no [joint.motor]; give it one, or use 'torque'.",
        )
    drive_fields.finish()
    for i, joint in enumerate(joints, 1):
        link = links[i - 1] if i <= len(links) else None
        inertia = float(joint.hub_inertia) + float(joint.reflected_inertia)
        if link is None and inertia == 0.0:
            raise ArmFileError(
                f"{file}: joint {i}: hub_inertia: found 0; a joint without a link needs a "
                "positive hub_inertia or rotor_inertia."
            )
    effects = tuple(
        _effect(Fields(part, f"effect {i}: ", file), links, joints)
        for i, part in enumerate(_tables(top, "effect"), 1)
    )
    uncertainty = _uncertainty(Fields(top.take("uncertainty", {}), "uncertainty: ", file))
    design = top.take("design")
    if design is not None and not isinstance(design, dict):
        raise top.fail("design", f"found {design!r}; a table is needed.")
    top.finish()
    arm = Arm(links, joints, payload, gravity or None, drive, effects, name, side)
    return ArmFile(arm, uncertainty, design, sections)


def _tables(top: Fields, key: str) -> list:
    value = top.take(key, [])
    if not isinstance(value, list):
        raise top.fail(key, f"found one [{key}] table; write [[{key}]], once for each {key}.")
    return value


def _link(fields: Fields) -> Link:
    length = fields.number("length", required=True)
    modes = fields.whole("modes", 2, 0)
    shapes = fields.choice("mode_shapes", "distal_mass_and_moment", list(MODE_SHAPES))
    model = fields.choice("model", "assumed_modes", ["assumed_modes", "lumped"])
    segments = fields.whole("segments", 20, 1)
    if model == "lumped" and modes > segments:
        raise fields.fail("modes", f"found {modes}; at most segments = {segments} is allowed.")
    options: dict[str, Any] = dict(
        damping_ratio=_damping(fields, modes),
        modes=modes,
        mode_shapes=shapes,
        model=model,
        segments=segments,
        gauge_position=fields.number(
            "gauge_position", 0.0, "a number from 0 to the length", lambda x: 0 <= x <= (length or 0)
        ),
        root_stiffness=fields.not_negative("root_stiffness"),
        root_compliance=fields.not_negative("root_compliance", None),
        shortening=fields.not_negative("shortening", None),
        motion=fields.choice("motion", "finite", list(MOTIONS)),
        deflection_from=fields.choice("deflection_from", "tip", list(INSTRUMENTS)),
    )
    by_section = any(fields.has(key) for key in ("width", "youngs_modulus", "density"))
    if by_section and any(fields.has(key) for key in DIRECT_KEYS):
        raise fields.fail(
            "mass_per_length",
            f"found together with a section; give either {', '.join(SECTION_KEYS)} or "
            f"{', '.join(DIRECT_KEYS)}.",
        )
    if by_section:
        section = [fields.number(key, required=True) for key in SECTION_KEYS]
        fields.finish()
        return Link.from_rectangle(length, *section, **options)
    direct = [fields.number(key, required=True) for key in DIRECT_KEYS]
    thickness = fields.number("thickness")
    fields.finish()
    return Link(length, *direct, thickness=thickness, **options)


def _damping(fields: Fields, modes: int) -> Any:
    rule, ratio = fields.take("damping"), fields.take("damping_ratio")
    if rule is not None:
        if ratio is not None:
            raise fields.fail("damping", "found together with damping_ratio; give one of them.")
        if rule != "ahmad":
            raise fields.fail("damping", f"found {rule!r}; allowed is 'ahmad' (or use damping_ratio).")
        return rule
    ratios = ratio if isinstance(ratio, list) else [0.0 if ratio is None else ratio]
    good = all(isinstance(r, (int, float)) and not isinstance(r, bool) and 0 <= r < 1 for r in ratios)
    if not good or not ratios:
        raise fields.fail(
            "damping_ratio", f"found {ratio!r}; a number from 0 to below 1, or a list with one a mode."
        )
    if isinstance(ratio, list) and len(ratios) != max(modes, 1):
        raise fields.fail("damping_ratio", f"found {len(ratios)} values for modes = {modes}; one a mode.")
    return tuple(float(r) for r in ratios)


def _joint(fields: Fields, file: str, number: int) -> Joint:
    motor = fields.take("motor")
    joint = Joint(
        hub_inertia=fields.not_negative("hub_inertia"),
        hub_mass=fields.not_negative("hub_mass"),
        viscous_friction=fields.not_negative("viscous_friction"),
        rotor_inertia=fields.not_negative("rotor_inertia"),
        compliance=fields.not_negative("compliance", None),
        play=fields.not_negative("play", None),
        contact_stiffness=fields.number("contact_stiffness"),
        contact_damping=fields.not_negative("contact_damping"),
        motor_share=fields.number("motor_share", 1.0),
        motor=None if motor is None else _motor(Fields(motor, f"joint {number}: motor: ", file)),
    )
    if joint.play is not None and joint.contact_stiffness is None:
        raise fields.fail("contact_stiffness", "missing; a joint with play needs a positive number.")
    fields.finish()
    return joint


def _motor(fields: Fields) -> DCMotor:
    motor = DCMotor(
        resistance=fields.number("resistance", required=True),
        torque_constant=fields.number("torque_constant", required=True),
        back_emf_constant=fields.not_negative("back_emf_constant", 0.0),
        # without inductance the current follows at once: it is then no state at all
        inductance=fields.not_negative("inductance") or None,
        gear_ratio=fields.number("gear_ratio", 1.0),
        efficiency=fields.number("efficiency", 1.0, "a number above 0, at most 1", lambda x: 0 < x <= 1),
        voltage_limit=fields.number("voltage_limit"),
    )
    fields.finish()
    return motor


def _effect(fields: Fields, links: tuple, joints: tuple) -> AbstractEffect:
    name = fields.choice("name", "", list(EFFECTS))
    kind = EFFECTS[name]
    location = fields.choice("location", "", places(kind, links, joints))
    values = {}
    for part in dataclasses.fields(kind):
        if part.name == "location":
            continue
        required = part.default is dataclasses.MISSING
        if part.default is None:
            value = fields.number(part.name)
        else:
            value = fields.number(part.name, None, "a number", lambda x: True, required)
        if value is not None:
            values[part.name] = value
    fields.finish()
    return kind(location=location, **values)


def places(kind: type[AbstractEffect], links: tuple, joints: tuple) -> list[str]:
    """Every location that an effect of this kind may have on an arm of these parts."""
    if kind.place in ("tip", "base"):
        return [kind.place]
    if kind.place == "link":
        return [f"link_{i}" for i in range(1, len(links) + 1)]
    if kind.place == "channel":
        numbered = [name for name in UNITS if name not in ("time", "tip_x", "tip_y")]
        return [f"{name}_{i}" for name in numbered for i in range(1, len(joints) + 1)] + ["tip_x", "tip_y"]
    return [
        f"joint_{i}" for i, joint in enumerate(joints, 1) if kind.place == "joint" or joint.motor is not None
    ]


def _uncertainty(fields: Fields) -> dict[str, float]:
    known = ["default", "length", *SECTION_KEYS, *DIRECT_KEYS, "damping_ratio"]
    known += ["hub_inertia", "hub_mass", "viscous_friction", "rotor_inertia", "resistance"]
    known += ["inductance", "torque_constant", "back_emf_constant", "gear_ratio", "efficiency"]
    known += ["payload_mass", "payload_inertia", "mass", "inertia"]
    found = {key: fields.not_negative(key, None) for key in known}
    fields.finish()
    return {key: value for key, value in found.items() if value is not None}


def save_arm(
    arm: Arm,
    path: str | Path,
    uncertainty: dict[str, float] | None = None,
    design: dict[str, Any] | None = None,
) -> None:
    """Write `arm` to `path`, so that `read_arm_file` gives it back.

    Sections are written as `mass_per_length` and `flexural_rigidity`.

    **Raises** `ValueError` for a link of another class than `Link`.
    """
    lines = [f"name = {_toml(arm.name)}"]
    lines.append(f"gravity = {_toml(0.0 if arm.gravity is None else arm.gravity)}")
    if arm.side_gravity is not None:
        lines.append(f"side_gravity = {_toml(arm.side_gravity)}")
    for number, link in enumerate(arm.links, 1):
        if not isinstance(link, Link):
            raise ValueError(
                f"link {number} is a {type(link).__name__}; an arm file holds links of the class Link "
                "alone: keep this arm with save_model."
            )
        lines += ["", "[[link]]", *_pairs(link, ("damping_ratio",))]
        ratios = link.damping_ratio
        if isinstance(ratios, str):
            lines.append('damping = "ahmad"')
        else:
            lines.append(f"damping_ratio = {_toml(ratios[0] if len(ratios) == 1 else list(ratios))}")
    for joint in arm.joints:
        lines += ["", "[[joint]]", *_pairs(joint, ("motor",))]
        if joint.motor is not None:
            lines += ["", "[joint.motor]", *_pairs(joint.motor)]
    lines += ["", "[payload]", *_pairs(arm.payload)]
    lines += ["", "[drive]", f"input = {_toml(arm.drive)}"]
    for effect in arm.effects:
        lines += ["", "[[effect]]", f"name = {_toml(effect.name)}", *_pairs(effect)]
    for title, table in (("uncertainty", uncertainty), ("design", design)):
        if table:
            lines += ["", f"[{title}]", *(f"{key} = {_toml(value)}" for key, value in table.items())]
    Path(path).write_text("\n".join(lines) + "\n")


def _pairs(part: Any, leave_out: tuple[str, ...] = ()) -> list[str]:
    values = {field.name: getattr(part, field.name) for field in dataclasses.fields(part)}
    return [
        f"{key} = {_toml(value)}"
        for key, value in values.items()
        if key not in leave_out and value is not None
    ]


def _toml(value: Any) -> str:
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return str(value)
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml(v) for v in value) + "]"
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(f"{value!r} cannot be written to an arm file; numbers must be finite.")
    return repr(number)
