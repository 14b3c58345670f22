"""The pieces of a run from their starts, some of them on every core."""

# arrays of numpy go to JAX and come back, which its annotations do not foresee
# pyright: reportArgumentType=false

import dataclasses
import os
from concurrent.futures import ThreadPoolExecutor

import jax
import jax.numpy as jnp
import numpy as np

from ..arm.arm import AssembledArm
from .plant import Instruments, Pieces, Response, respond

LEAST = 10  # pieces that are worth a thread


def respond_on_cores(
    model: AssembledArm,
    instruments: Instruments,
    channels: tuple[str, ...],
    starts: np.ndarray,
    pieces: Pieces,
) -> Response:
    """`respond`, in parts of equal size that are computed at the same time."""
    count = len(starts)
    parts = max(min(os.cpu_count() or 1, count // LEAST), 1)
    size = -(-count // parts)
    command, time = np.asarray(pieces.command), np.asarray(pieces.time)

    def part(k):
        at = np.minimum(np.arange(k * size, (k + 1) * size), count - 1)
        some = dataclasses.replace(pieces, command=jnp.asarray(command[at]), time=jnp.asarray(time[at]))
        return jax.tree.map(np.asarray, respond(model, instruments, channels, jnp.asarray(starts[at]), some))

    if parts == 1:
        return part(0)
    with ThreadPoolExecutor(parts) as pool:
        found = list(pool.map(part, range(parts)))
    return Response(*(np.concatenate(whole)[:count] for whole in zip(*found, strict=True)))
