"""Read a recording: CSV with a header of `channel [unit]`, rows by the million, errors to the row."""

import csv
from itertools import islice
from pathlib import Path
from typing import TextIO

import numpy as np

from .checks import findings
from .foreign import FOREIGN
from .headers import Table, parse_headers
from .recording import Recording, RecordingError

_ROWS = 200_000
"""Rows read at a time."""

_SPARSE = 0.5
"""Share of missing cells above which a column is left out, rather than the rows."""


def read_recording(path: str | Path) -> Recording:
    """Read the file at `path` and check it: CSV, or by its ending MATLAB, LabVIEW TDMS or Parquet.

    `.mat` of version 7.3, `.tdms` and `.parquet` need the extra `recordings`; what is expected
    in them is said in `jaxflex/files/foreign.py`.

    What is mended is said in `repairs`: columns with more than half of their cells missing are
    left out, then rows with an empty cell, NaN or infinity, and rows given twice. What looks wrong and is kept is
    said there too: see `findings`.

    **Raises** `RecordingError` for a file that cannot be read, a header that is not
    `channel [unit]`, a unit that does not fit, a cell that is no number, time that does not
    rise, or fewer than two rows.
    """
    file = str(path)
    suffix = Path(path).suffix.lower()
    table = FOREIGN[suffix](file) if suffix in FOREIGN else _read_csv(file, path)
    names, values, rows, repairs = _mend(table.names, table.values, table.rows)
    repairs = (*table.notes, *repairs)
    if values.shape[1] < 2:
        raise RecordingError(
            f"{file}: {values.shape[1]} complete row(s); at least two are needed."
            + "".join(f" {repair}." for repair in repairs)
        )
    _check_time(file, values[0], rows)
    channels = dict(zip(names[1:], values[1:], strict=True))
    recording = Recording(values[0], channels, repairs, file)
    return recording.noting(*findings(recording))


def _read_csv(file: str, path: str | Path) -> Table:
    """The table in a CSV file; `rows` are its lines."""
    try:
        with open(path, "rb") as stream:
            lines = 1
            while block := stream.read(1 << 20):
                lines += block.count(b"\n")
        with open(path, newline="", encoding="utf-8-sig") as stream:
            columns = next(csv.reader([stream.readline()]), [])
            if not columns:
                raise RecordingError(f"{file}: empty; a header of 'channel [unit]' and rows are needed.")
            names, scales = parse_headers(file, columns)
            values, rows = _read_rows(file, stream, names, lines)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise RecordingError(f"{file}: cannot be read: {error}.") from error
    values *= np.asarray(scales)[:, None]
    return Table(names, values, rows, ())


def _read_rows(file: str, stream: TextIO, names: list[str], lines: int) -> tuple[np.ndarray, np.ndarray]:
    """The cells, a row of the result for each column, and the line of the file that each came from."""
    values = np.empty((len(names), lines))
    numbers = np.empty(lines, dtype=np.int64)
    filled, line = 0, 2
    while chunk := list(islice(stream, _ROWS)):
        places = [i for i, text in enumerate(chunk) if text.strip()]
        if places:
            block = _parse(file, [chunk[i] for i in places], [line + i for i in places], names)
            values[:, filled : filled + len(places)] = block.T
            numbers[filled : filled + len(places)] = line + np.asarray(places)
        filled += len(places)
        line += len(chunk)
    return values[:, :filled], numbers[:filled]


def _parse(file: str, texts: list[str], numbers: list[int], names: list[str]) -> np.ndarray:
    """Numbers in `texts`: by numpy's loader, and cell by cell where that one meets something odd."""
    try:
        block = np.loadtxt(texts, delimiter=",", comments=None, ndmin=2)
        if block.shape == (len(texts), len(names)):
            return block
    except ValueError:
        pass
    block = np.full((len(texts), len(names)), np.nan)
    for i, row in enumerate(csv.reader(texts)):
        if len(row) != len(names):
            raise RecordingError(
                f"{file}: row {numbers[i]}: found {len(row)} cells, the header has {len(names)}."
            )
        for j, cell in enumerate(row):
            if cell.strip():
                try:
                    block[i, j] = float(cell)
                except ValueError:
                    raise RecordingError(
                        f"{file}: row {numbers[i]}, {names[j]}: {cell!r} is no number; "
                        "an empty cell or nan stands for a missing one."
                    ) from None
    return block


def _mend(
    names: list[str], values: np.ndarray, rows: np.ndarray
) -> tuple[list[str], np.ndarray, np.ndarray, tuple[str, ...]]:
    """Leave out columns without a number, rows that are not whole and rows given twice, and say so."""
    repairs = []
    finite = np.isfinite(values)
    lacking = np.count_nonzero(~finite, axis=1)
    sparse = (lacking > _SPARSE * finite.shape[1]) & (np.arange(len(names)) > 0)
    for name, count in zip(names, lacking * sparse, strict=True):
        if count:
            repairs.append(f"{name}: no number in {count} of {finite.shape[1]} rows; the column was left out")
    names = [name for name, few in zip(names, sparse, strict=True) if not few]
    values, finite = values[~sparse], finite[~sparse]
    whole = np.all(finite, axis=0)
    if not np.all(whole):
        columns = [name for name, given in zip(names, np.all(finite, axis=1), strict=True) if not given]
        repairs.append(
            f"{np.count_nonzero(~whole)} of {finite.shape[1]} rows hold a gap or NaN and were left out "
            f"({', '.join(columns)}), the first is row {rows[np.argmin(whole)]}"
        )
        values, rows = values[:, whole], rows[whole]
    again = np.zeros(values.shape[1], dtype=bool)
    twice = np.flatnonzero(np.diff(values[0]) == 0) + 1
    again[twice] = (values[:, twice] == values[:, twice - 1]).all(axis=0)
    if np.any(again):
        repairs.append(
            f"{np.count_nonzero(again)} rows repeat the one before and were left out, "
            f"the first is row {rows[np.argmax(again)]}"
        )
        values, rows = values[:, ~again], rows[~again]
    return names, values, rows, tuple(repairs)


def _check_time(file: str, times: np.ndarray, rows: np.ndarray) -> None:
    """Time rises from row to row."""
    steps = np.diff(times)
    if (steps > 0).all():
        return
    i = int(np.argmax(steps <= 0)) + 1
    found = f"found {times[i]:.9g} s after {times[i - 1]:.9g} s"
    if steps[i - 1] == 0:
        remedy = "rows differ at the same time; write times with more digits"
    else:
        remedy = "rows must be in order of time, one run a file"
    raise RecordingError(f"{file}: time does not rise at row {rows[i]}: {found}; {remedy}.")
