"""Units that a recording may be written in and what they are in SI; units of an arm's parameters."""

import math

_PREFIXES = {"": 1.0, "k": 1e3, "m": 1e-3, "u": 1e-6, "µ": 1e-6, "c": 1e-2, "n": 1e-9}
_BASES = ("s", "V", "A", "N m", "rad", "rad/s", "m", "m/s^2")
_SPECIAL = {
    "deg": ("rad", math.pi / 180),
    "deg/s": ("rad/s", math.pi / 180),
    "rpm": ("rad/s", 2 * math.pi / 60),
    "g": ("m/s^2", 9.80665),
    "%": ("1", 1e-2),
    "1": ("1", 1.0),
    "": ("1", 1.0),
    "ustrain": ("1", 1e-6),
    "µε": ("1", 1e-6),
    "mm/s^2": ("m/s^2", 1e-3),
    "min": ("s", 60.0),
}


def factor(given: str, wanted: str) -> float | None:
    """What a value in unit `given` is multiplied by to be in SI unit `wanted`; None if it cannot be."""
    if given in _SPECIAL:
        base, scale = _SPECIAL[given]
        return scale if base == wanted else None
    for base in sorted(_BASES, key=len, reverse=True):
        if base == wanted and given.endswith(base):
            return _PREFIXES.get(given[: len(given) - len(base)].strip())
    return None


_PARAMETERS = {
    "length": "m",
    "width": "m",
    "thickness": "m",
    "youngs_modulus": "Pa",
    "density": "kg/m^3",
    "mass_per_length": "kg/m",
    "flexural_rigidity": "N m^2",
    "damping_ratio": "1",
    "hub_inertia": "kg m^2",
    "hub_mass": "kg",
    "viscous_friction": "N m s/rad",
    "rotor_inertia": "kg m^2",
    "contact_stiffness": "N m/rad",
    "contact_damping": "N m s/rad",
    "motor_share": "1",
    "resistance": "ohm",
    "inductance": "H",
    "torque_constant": "N m/A",
    "back_emf_constant": "V s/rad",
    "payload_mass": "kg",
    "payload_inertia": "kg m^2",
}


def parameter_unit(name: str) -> str:
    """Unit of a nominal parameter such as `density` or `hub_inertia_2`; raises `KeyError` if unknown."""
    return _PARAMETERS[name.rstrip("0123456789").removesuffix("_")]
