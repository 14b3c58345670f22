"""What the columns of a recording are called: `channel [unit]`, and what that is in SI."""

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..sensors import UNITS
from .recording import RecordingError
from .units import factor

_HEADER = re.compile(r"^\s*([A-Za-z]\w*)\s*\[\s*([^\]]*?)\s*\]\s*$")
_WHOLE = ("time", "tip_x", "tip_y")


class Table(NamedTuple):
    """Columns of a file, in SI units, `time` first.

    `values` has a row for each of `names`; `rows` numbers the rows of the file as its errors
    do; `notes` say what was left out.
    """

    names: list[str]
    values: np.ndarray
    rows: np.ndarray
    notes: tuple[str, ...]


def parse_headers(file: str, columns: Sequence[str]) -> tuple[list[str], list[float]]:
    """Names of the columns and their factors to SI.

    **Raises** `RecordingError` for a header that is not `channel [unit]`, an unknown channel, a
    unit that does not fit, a channel given twice, or a first column that is not time.
    """
    names, scales = [], []
    for column in columns:
        match = _HEADER.match(column)
        if match is None:
            hint = " Columns are separated by commas." if ";" in column or "\t" in column else ""
            raise RecordingError(
                f"{file}: column {column!r}: a header such as 'angle_1 [rad]' is needed.{hint}"
            )
        name, given = match.groups()
        if not is_channel(name):
            raise RecordingError(
                f"{file}: column {column!r}: unknown channel; known are {known_channels()}, "
                "where the number is the joint's or link's."
            )
        base = _base(name)
        scale = factor(given, UNITS[base])
        if scale is None:
            raise RecordingError(
                f"{file}: column {column!r}: unit [{given}] is not one of [{UNITS[base]}]; "
                "multiples such as [mrad], [deg] or [mV] are allowed."
            )
        names.append(name)
        scales.append(scale)
    if names[0] != "time":
        raise RecordingError(f"{file}: first column {columns[0]!r}: 'time [s]' is needed.")
    for name in names:
        if names.count(name) > 1:
            raise RecordingError(f"{file}: {name}: a channel is given twice; each must be there once.")
    return names, scales


def is_channel(name: str) -> bool:
    """True for the name of a channel, such as `angle_1` or `tip_x`, and for `time`."""
    base = _base(name)
    return base in UNITS and (base == name) == (name in _WHOLE)


def known_channels() -> str:
    """Every channel in words, for errors."""
    return ", ".join([*_WHOLE, *(f"{each}_1" for each in UNITS if each not in _WHOLE)])


def _base(name: str) -> str:
    return re.sub(r"_[1-9]\d*$", "", name)
