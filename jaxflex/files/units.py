"""Units that a recording may be written in, and what they are in SI."""

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
