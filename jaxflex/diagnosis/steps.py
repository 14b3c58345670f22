"""Slopes of a run's pieces from those of its sample intervals.

An interval knows nothing of the one before it but the state it begins with. So all
intervals of a run are made linear side by side, by their states, by what acts during them
and by the parameters of the arm; a slope along a piece is then products of small
matrices, and a force or a command, whatever its course, costs no more than that.
"""

# arrays of numpy go to JAX and come back, which its annotations do not foresee
# pyright: reportArgumentType=false, reportOptionalMemberAccess=false

import itertools
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np

from ..arm.arm import AssembledArm
from .plant import Direction, Instruments, Interval, Moments, Pieces, Response, interval_slopes, lag

MOMENTS = 850  # intervals that are made linear at once; fewer take longer, and powers of two do
LANES = 8  # parameters whose slopes are taken side by side: one compiled program whatever their number


@dataclass(frozen=True)
class Steps:
    """Every interval of a run made linear: tables `(pieces, samples, outcomes, columns)`.

    The outcomes of an interval are the state after it, then what perfect instruments show
    before and after.
    """

    before: np.ndarray  # what perfect instruments show, (pieces, samples, channels)
    after: np.ndarray
    by_state: np.ndarray
    by_input: np.ndarray  # columns: commands, then forces on the coordinates


@dataclass(frozen=True)
class Point:
    """What the intervals of a run were made linear about, and all slopes found there so far."""

    vector: np.ndarray
    starts: np.ndarray
    command: np.ndarray
    steps: Steps
    by_parameter: dict[int, np.ndarray]  # outcomes of the intervals, (pieces, samples, outcomes)

    def is_at(self, *here: np.ndarray) -> bool:
        """True if vector, starts and command are still these."""
        return all(map(np.array_equal, here, (self.vector, self.starts, self.command)))


class Intervals:
    """The intervals of the pieces that gave a `response`, to be made linear there."""

    def __init__(self, model: AssembledArm, channels: tuple[str, ...], pieces: Pieces, response: Response):
        self.model = model
        self.channels = channels
        self.pieces = pieces
        self.shape = pieces.time.shape
        count = int(np.prod(self.shape))
        self.chunks = np.minimum(np.arange(-(-count // MOMENTS) * MOMENTS), count - 1).reshape(-1, MOMENTS)
        moving = response.states[..., : -len(channels)]
        parts = (moving, np.asarray(pieces.command), np.asarray(pieces.time))
        self.moments = Moments(*(part.reshape(count, *part.shape[2:]) for part in parts))

    def steps(self) -> Steps:
        """The intervals with their slopes by state and by what acts."""
        moving, joints = self.moments.x.shape[1], self.moments.command.shape[1]
        sizes = (moving, joints, self.model.size)
        x, command, force = np.split(np.eye(sum(sizes)), np.cumsum(sizes)[:-1], axis=1)
        [(found, table)] = self._tables([Direction(None, x, command, force)])
        return Steps(found.before, found.after, table[..., :moving], table[..., moving:])

    def by_parameters(self, tangents: list[Any]) -> list[np.ndarray]:
        """Slopes of the outcomes along groups of directions of the model's leaves."""
        return [table for _, table in self._tables([Direction(moved) for moved in tangents])]

    def _tables(self, directions: list[Direction]) -> list[tuple[Interval, np.ndarray]]:
        def some(task):
            direction, chunk = task
            part = Moments(*(a[chunk] for a in self.moments))
            found = interval_slopes(
                self.model, self.channels, self.pieces.sample_time, self.pieces.stepping, part, direction
            )
            return [np.asarray(a) for interval in found for a in interval]

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            done = list(pool.map(some, itertools.product(directions, self.chunks)))
        chunks = len(self.chunks)
        return [self._joined(done[k * chunks : (k + 1) * chunks]) for k in range(len(directions))]

    def _joined(self, chunks: list[list[np.ndarray]]) -> tuple[Interval, np.ndarray]:
        count = int(np.prod(self.shape))
        parts = list(zip(*chunks, strict=True))
        point = [np.concatenate(part)[:count].reshape(*self.shape, -1) for part in parts[:3]]
        outcomes = [np.concatenate(part, 1)[:, :count] for part in parts[3:]]
        table = np.ascontiguousarray(np.moveaxis(np.concatenate(outcomes, -1), 0, -1))
        return Interval(*point), table.reshape(*self.shape, *table.shape[1:])


def along_pieces(
    steps: Steps,
    response: Response,
    pieces: Pieces,
    instruments: Instruments,
    starts: np.ndarray,
    source: Callable[[int], np.ndarray],
    faults: Instruments,
) -> tuple[np.ndarray, np.ndarray]:
    """Slopes of readings `(pieces, samples, channels, columns)` and ends `(pieces, states, columns)`.

    `starts`: slopes of a start, `(states, columns)`; `source`: what the interval of a
    sample adds to its outcomes, `(pieces, outcomes, columns)`; `faults`: slopes of the instruments,
    `(channels, columns)` each.
    """
    samples, channels = response.reading.shape[1:]
    moving = len(starts) - channels
    (decay, mean), (decay_slope, mean_slope) = jax.jvp(
        lambda time: lag(time, pieces.sample_time), (instruments.lag,), (np.ones(channels),)
    )
    decay, mean, decay_slope, mean_slope = (
        np.asarray(part)[:, None] for part in (decay, mean, decay_slope, mean_slope)
    )
    count = response.reading.shape[0]
    state = np.zeros((count, steps.by_state.shape[-1], starts.shape[1]))
    state[:, :moving] = starts[:moving]
    shown = np.repeat(starts[None, moving:], count, 0)
    reading = np.empty((count, samples, channels, starts.shape[1]))
    time = np.asarray(pieces.time)[..., None, None]
    for k in range(samples):
        now = response.states[:, k, moving:, None]
        reading[:, k] = instruments.gain[:, None] * shown + faults.gain * now + faults.bias
        reading[:, k] += faults.drift * time[:, k]
        found = steps.by_state[:, k] @ state + source(k)
        state, before, after = np.split(found, [state.shape[1], state.shape[1] + channels], axis=1)
        shown = decay * shown + (mean - decay) * before + (1 - mean) * after
        before, after = steps.before[:, k, :, None], steps.after[:, k, :, None]
        late = decay_slope * now + (mean_slope - decay_slope) * before - mean_slope * after
        shown = shown + faults.lag * late
    return reading, np.concatenate([state[:, :moving], shown], 1)
