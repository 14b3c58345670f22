"""A shaper in a TOML file, as `jaxflex shaper` writes it."""

import tomllib
from pathlib import Path

import jax.numpy as jnp
import numpy as np

from .shaper import Shaper


def load_shaper(path: str | Path) -> Shaper:
    """The shaper in the table `[shaper]` of the TOML file at `path`.

    `amplitudes`, which sum to one, and `delays` [s], which rise from 0.

    **Raises** `ValueError` for a file that cannot be read or holds no such shaper; the
    message says what was found and what is allowed.
    """
    try:
        with open(path, "rb") as stream:
            table = tomllib.load(stream).get("shaper")
    except (OSError, tomllib.TOMLDecodeError) as error:
        raise ValueError(f"{path}: cannot be read: {error}.") from error
    if not isinstance(table, dict):
        raise ValueError(f"{path}: no table [shaper]; one with amplitudes and delays is needed.")
    columns = []
    for key in ("amplitudes", "delays"):
        found = table.get(key)
        if not isinstance(found, list) or not found or not all(type(v) in (int, float) for v in found):
            raise ValueError(f"{path}: shaper: {key}: found {found!r}; a list of numbers is needed.")
        columns.append(np.asarray(found, dtype=float))
    amplitudes, delays = columns
    if amplitudes.shape != delays.shape:
        raise ValueError(
            f"{path}: shaper: {len(amplitudes)} amplitudes and {len(delays)} delays; as many of both are needed."
        )
    if not np.all(np.isfinite(amplitudes)) or abs(amplitudes.sum() - 1) > 1e-6:
        raise ValueError(f"{path}: shaper: amplitudes: they sum to {amplitudes.sum():g}; 1 is needed.")
    if delays[0] != 0 or not np.all(np.diff(delays) >= 0) or not np.all(np.isfinite(delays)):
        raise ValueError(f"{path}: shaper: delays: found {delays.tolist()}; times rising from 0 are needed.")
    return Shaper(jnp.asarray(amplitudes), jnp.asarray(delays))
