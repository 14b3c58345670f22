"""Recordings: CSV with a header of `channel [unit]`, checked and converted to SI."""

import csv
import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..sensors import unit

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
_HEADER = re.compile(r"^\s*([A-Za-z]\w*)\s*\[\s*([^\]]*?)\s*\]\s*$")


class RecordingError(ValueError):
    """A recording that cannot be used; the message names file, column, found and allowed."""


@dataclass(frozen=True)
class Recording:
    """Measured channels in SI units at `times` [s]; `repairs` says what was mended on reading."""

    times: np.ndarray
    channels: dict[str, np.ndarray]
    repairs: tuple[str, ...]

    def __getitem__(self, channel: str) -> np.ndarray:
        if channel not in self.channels:
            raise KeyError(f"no channel {channel!r}; there are {', '.join(self.channels)}.")
        return self.channels[channel]


def factor(given: str, wanted: str) -> float | None:
    """What a value in unit `given` is multiplied by to be in SI unit `wanted`; None if it cannot be."""
    if given in _SPECIAL:
        base, scale = _SPECIAL[given]
        return scale if base == wanted else None
    for base in sorted(_BASES, key=len, reverse=True):
        if base == wanted and given.endswith(base):
            return _PREFIXES.get(given[: len(given) - len(base)].strip())
    return None


def read_recording(path: str | Path) -> Recording:
    """Read the CSV at `path`.

    Rows that hold a NaN or an empty cell are left out and reported in `repairs`.

    **Raises** `RecordingError` for a file that cannot be read, a header that is not
    `channel [unit]`, a unit that does not fit, time that does not rise, or fewer than
    two rows.
    """
    file = str(path)
    try:
        with open(path, newline="", encoding="utf-8-sig") as stream:
            rows = [row for row in csv.reader(stream) if row]
    except (OSError, UnicodeDecodeError) as error:
        raise RecordingError(f"{file}: cannot be read: {error}.") from error
    if not rows:
        raise RecordingError(f"{file}: empty; a header of 'channel [unit]' and rows are needed.")
    names, scales = [], []
    for column in rows[0]:
        match = _HEADER.match(column)
        if match is None:
            raise RecordingError(f"{file}: column {column!r}: a header such as 'angle_1 [rad]' is needed.")
        name, given = match.groups()
        try:
            wanted = unit(name)
        except KeyError:
            raise RecordingError(
                f"{file}: column {column!r}: unknown channel; see the recording format."
            ) from None
        scale = factor(given, wanted)
        if scale is None:
            raise RecordingError(f"{file}: column {column!r}: unit [{given}] is not one of [{wanted}].")
        names.append(name)
        scales.append(scale)
    if names[0] != "time":
        raise RecordingError(f"{file}: first column {rows[0][0]!r}: 'time [s]' is needed.")
    if len(set(names)) != len(names):
        raise RecordingError(f"{file}: a channel is given twice; each must be there once.")
    values = np.full((len(rows) - 1, len(names)), np.nan)
    for i, row in enumerate(rows[1:]):
        if len(row) != len(names):
            raise RecordingError(f"{file}: row {i + 2}: found {len(row)} cells, the header has {len(names)}.")
        for j, cell in enumerate(row):
            if cell.strip():
                try:
                    values[i, j] = float(cell)
                except ValueError:
                    raise RecordingError(f"{file}: row {i + 2}, {names[j]}: {cell!r} is no number.") from None
    values = values * np.asarray(scales)
    whole = np.asarray(np.isfinite(values).all(axis=1))
    repairs = ()
    if not whole.all():
        repairs = (f"{int((~whole).sum())} of {len(whole)} rows hold a gap or NaN and were left out",)
        values = values[whole]
    if len(values) < 2:
        raise RecordingError(f"{file}: {len(values)} complete row(s); at least two are needed.")
    if not (np.diff(values[:, 0]) > 0).all():
        row = int(np.argmin(np.diff(values[:, 0]))) + 3
        raise RecordingError(f"{file}: time does not rise at row {row}; rows must be in order of time.")
    return Recording(values[:, 0], {n: values[:, j] for j, n in enumerate(names) if j}, repairs)
