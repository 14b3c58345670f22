"""Write series as CSV with units in the header."""

import csv
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..sensors import unit


def write_series(path: str | Path, times: np.ndarray, channels: Mapping[str, np.ndarray]) -> None:
    """CSV in the recording format: `time [s]` and every channel with its unit."""
    with open(path, "w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(["time [s]", *(f"{name} [{unit(name)}]" for name in channels)])
        columns = [np.asarray(times), *(np.asarray(values) for values in channels.values())]
        writer.writerows([f"{value:.9g}" for value in row] for row in zip(*columns, strict=True))
