"""Recordings in the files of other programs: MATLAB, LabVIEW TDMS, Parquet.

Channels are named as in a CSV recording. A unit is taken from where each format keeps it, or
from a name such as `angle_1 [deg]`; a channel without one is in SI units. What is no channel
is left out and said in `repairs`.

| file | channels | units |
|---|---|---|
| `.mat` | vectors of equal length, also as fields of one struct | a struct `units` with a text a channel |
| `.tdms` | channels of any group; `time`, or else the waveform's own increment | property `unit_string` |
| `.parquet` | columns | key `unit` in the metadata of the column |
"""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import scipy  # whose parts, imported when first used, take longer to import than all here

from ..sensors import unit as si
from ..simulation.frames import extra
from .headers import Table, is_channel, known_channels, parse_headers
from .recording import RecordingError

Column = tuple[str, str | None, Any]
"""Name, unit if the file says one, and values."""


def read_mat(file: str) -> Table:
    """The recording in a MATLAB file of any version from 5 on; 7.3 needs the extra `recordings`."""
    try:
        with open(file, "rb") as stream:
            is_hdf = b"MATLAB 7.3" in stream.read(128)
        found = _read_hdf(file) if is_hdf else scipy.io.loadmat(file, simplify_cells=True)
    except (OSError, ValueError, TypeError, IndexError, scipy.io.matlab.MatReadError) as error:
        raise RecordingError(f"{file}: cannot be read as a MATLAB file: {error}.") from error
    found = {name: value for name, value in found.items() if not name.startswith(("__", "#"))}
    units = found.pop("units", {})
    structs = [value for value in found.values() if isinstance(value, dict)]
    if "time" not in found and len(structs) == 1:
        found = dict(structs[0])
        units = found.pop("units", units)
    if not isinstance(units, dict):
        raise RecordingError(f"{file}: units: a struct with a text for each channel is needed.")
    if not all(isinstance(unit, str) for unit in units.values()):
        raise RecordingError(f"{file}: units: a struct with a text for each channel is needed.")
    columns = []
    for name, value in found.items():
        values = np.squeeze(np.asarray(value)) if not isinstance(value, dict) else np.empty(0, object)
        columns.append((name, units.get(name), values))
    return _table(file, columns)


def _read_hdf(file: str) -> dict[str, Any]:
    h5py = _reader("h5py", file)

    def plain(item: Any) -> Any:
        if isinstance(item, h5py.Group):
            return {name: plain(part) for name, part in item.items()}
        values = np.asarray(item)
        kind = item.attrs.get("MATLAB_class", b"")
        if (kind.decode() if isinstance(kind, bytes) else str(kind)) == "char":
            return "".join(chr(code) for code in values.reshape(-1))
        return values

    with h5py.File(file, "r") as stream:
        return {name: plain(item) for name, item in stream.items()}


def read_tdms(file: str) -> Table:
    """The recording in a TDMS file of LabVIEW; needs the extra `recordings`."""
    nptdms = _reader("nptdms", file)
    try:
        groups = nptdms.TdmsFile.read(file).groups()
    except (OSError, ValueError) as error:
        raise RecordingError(f"{file}: cannot be read as a TDMS file: {error}.") from error
    channels = [channel for group in groups for channel in group.channels()]
    if not channels:
        raise RecordingError(f"{file}: cannot be read as a TDMS file: it holds no channel.")
    columns: list[Column] = [(c.name, c.properties.get("unit_string"), c[:]) for c in channels]
    timed = [c for c in channels if "wf_increment" in c.properties and is_channel(_plain(c.name))]
    if not any(_plain(name) == "time" for name, *_ in columns) and timed:
        steps = {
            (float(c.properties["wf_increment"]), float(c.properties.get("wf_start_offset", 0)))
            for c in timed
        }
        if len(steps) > 1:
            raise RecordingError(
                f"{file}: the channels have different time increments; one is needed for all."
            )
        columns.append(("time", "s", timed[0].time_track()))
    return _table(file, columns)


def read_parquet(file: str) -> Table:
    """The recording in a Parquet file; needs the extra `recordings`."""
    parquet = _reader("pyarrow.parquet", file)
    try:
        table = parquet.read_table(file)
    except (OSError, ValueError) as error:
        raise RecordingError(f"{file}: cannot be read as a Parquet file: {error}.") from error
    columns = []
    for field, column in zip(table.schema, table.columns, strict=True):
        unit = (field.metadata or {}).get(b"unit")
        columns.append((field.name, None if unit is None else unit.decode(), column.to_numpy()))
    return _table(file, columns)


FOREIGN: dict[str, Callable[[str], Table]] = {
    ".mat": read_mat,
    ".tdms": read_tdms,
    ".parquet": read_parquet,
}


def _reader(module: str, file: str) -> Any:
    try:
        return extra(module, "recordings", "reading it")
    except ImportError as error:
        raise RecordingError(f"{file}: {error}") from error


def _plain(name: str) -> str:
    return name.partition("[")[0].strip()


def _table(file: str, columns: Iterable[Column]) -> Table:
    """The columns that are channels, time first, in SI units."""
    kept, left = [], []
    for name, unit, values in columns:
        (kept if is_channel(_plain(name)) else left).append((name, unit, values))
    kept.sort(key=lambda column: _plain(column[0]) != "time")
    if not kept or _plain(kept[0][0]) != "time":
        found = ", ".join(name for name, *_ in [*kept, *left]) or "nothing"
        raise RecordingError(f"{file}: found {found}; 'time' and any of {known_channels()} are needed.")
    length = np.shape(kept[0][2])
    notes, headers, rows = [], [], []
    if left:
        notes.append(f"no channels, left out: {', '.join(name for name, *_ in left)}")
    for name, unit, values in kept:
        if np.shape(values) != length or len(length) != 1:
            raise RecordingError(
                f"{file}: {name}: found shape {np.shape(values)}, time has {length}; vectors of one length are needed."
            )
        try:
            rows.append(np.asarray(values, dtype=float))
        except (TypeError, ValueError):
            raise RecordingError(
                f"{file}: {name}: found {np.asarray(values).dtype}; numbers are needed."
            ) from None
        headers.append(_header(file, name, unit, notes))
    names, scales = parse_headers(file, headers)
    values = np.array(rows) * np.asarray(scales)[:, None]
    return Table(names, values, np.arange(1, values.shape[1] + 1), tuple(notes))


def _header(file: str, name: str, unit: str | None, notes: list[str]) -> str:
    """`channel [unit]` of a column, from its name and what the file says beside it."""
    if "[" in name:
        return name
    if unit is None or not str(unit).strip():
        notes.append(f"{name}: no unit given; taken as [{si(name.strip())}]")
        return f"{name} [{si(name.strip())}]"
    return f"{name} [{str(unit).strip('[] ')}]"
