"""Channels over time as pandas and xarray know them, and back.

Columns are named as channels, in SI units; the units stand in `attrs`. Both libraries are
the extra `frames`, imported when asked for.
"""

from collections.abc import Mapping
from importlib import import_module
from typing import Any

import numpy as np

from ..sensors import unit


def extra(module: str, name: str, purpose: str) -> Any:
    """The optional `module`; raises `ImportError` that names the extra of jaxflex which brings it."""
    try:
        return import_module(module)
    except ImportError as error:
        raise ImportError(
            f"{purpose} needs {module.partition('.')[0]}, which is not installed; "
            f"pip install 'jaxflex[{name}]' brings it."
        ) from error


def to_frame(times: Any, channels: Mapping[str, Any]) -> Any:
    """A `pandas.DataFrame` with the index `time` [s] and a column for each channel.

    A batch, with leading axes before time, gets an index level for each: `member`, or
    `member_1`, `member_2` ….
    """
    pandas = extra("pandas", "frames", "a DataFrame")
    times = np.asarray(times)
    columns = {name: np.asarray(values).reshape(-1) for name, values in channels.items()}
    if times.ndim == 1:
        index = pandas.Index(times, name="time")
    else:
        members = np.indices(times.shape)[:-1].reshape(times.ndim - 1, -1)
        names = [*_batch_names(times.ndim - 1), "time"]
        index = pandas.MultiIndex.from_arrays([*members, times.reshape(-1)], names=names)
    frame = pandas.DataFrame(columns, index=index)
    frame.attrs["units"] = {"time": "s"} | {name: unit(name) for name in channels}
    return frame


def from_frame(frame: Any) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Times and channels of a DataFrame such as `to_frame` gives; `time` may be a column too.

    **Raises** `ValueError` for a frame without time, or a column that is no channel.
    """
    named = frame.reset_index() if "time" in frame.index.names else frame
    if "time" not in named.columns:
        raise ValueError(f"the frame has no 'time' [s], index or column; found {', '.join(named.columns)}.")
    batch = [name for name in frame.index.names if name and name.startswith("member")]
    shape = (*(named[name].nunique() for name in batch), -1)
    data = {name: named[name].to_numpy(float).reshape(shape) for name in named.columns if name not in batch}
    return _split(data)


def to_dataset(times: Any, channels: Mapping[str, Any]) -> Any:
    """An `xarray.Dataset`: dimensions of the batch, then `time` [s]; each variable with its `units`.

    Members of a batch whose times differ are refused with `ValueError`.
    """
    xarray = extra("xarray", "frames", "a Dataset")
    times = np.asarray(times)
    axis = times.reshape(-1, times.shape[-1])
    if not np.all(axis == axis[0]):
        raise ValueError(
            "the members have different times; a Dataset has one time axis: convert them singly."
        )
    dims = (*_batch_names(times.ndim - 1), "time")
    variables = {name: (dims, np.asarray(values), {"units": unit(name)}) for name, values in channels.items()}
    return xarray.Dataset(variables, coords={"time": ("time", axis[0], {"units": "s"})})


def from_dataset(dataset: Any) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Times and channels of a Dataset such as `to_dataset` gives.

    **Raises** `ValueError` for one without a dimension `time`, or a variable that is no channel.
    """
    if "time" not in dataset.coords:
        raise ValueError(f"the Dataset has no coordinate 'time' [s]; found {', '.join(dataset.coords)}.")
    data = {name: dataset[name].transpose(..., "time").to_numpy() for name in dataset.data_vars}
    shape = next(iter(data.values())).shape if data else dataset["time"].shape
    return _split(data | {"time": np.broadcast_to(dataset["time"].to_numpy(), shape)})


def _batch_names(count: int) -> list[str]:
    return ["member"] if count == 1 else [f"member_{i + 1}" for i in range(count)]


def _split(data: dict[str, np.ndarray]) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    for name in data:
        try:
            unit(name)
        except KeyError:
            raise ValueError(f"{name!r} is no channel; such as angle_1, voltage_1 or tip_x are.") from None
    return data["time"], {name: values for name, values in data.items() if name != "time"}
