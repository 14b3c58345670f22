"""Slopes of a run's pieces from those of its sample intervals.

An interval knows nothing of the one before it but the state it begins with. So all
intervals of a run are made linear side by side, by their states and by what acts during
them; a slope along a piece is then products of small matrices, and a force or a command,
whatever its course, costs no more than that. A parameter of the arm is as good as the
forces and voltages that make up for it while the motion stays: those halfway through an
interval, held over it, are its slope to second order in the sample time.
"""

# arrays of numpy go to JAX and come back, which its annotations do not foresee
# pyright: reportArgumentType=false, reportOptionalMemberAccess=false

import itertools
import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np

from ..arm.arm import AssembledArm
from .plant import Instruments, Pieces, Response, lag, push_size
from .slopes import Direction, Imbalance, Interval, Moments, imbalance_slopes, interval_slopes, true_readings

MOMENTS = 850  # intervals that are made linear at once; fewer take longer, and powers of two do
EVERY = 7  # of so many intervals one is made linear where nothing sticks, turns or strikes
LANES = 8  # parameters whose slopes are taken side by side: one compiled program whatever their number
FEW_LANES = 2  # the same of no more parameters than that


@dataclass(frozen=True)
class Steps:
    """Every interval of a run made linear: tables `(pieces, samples, outcomes, columns)`.

    The outcomes of an interval are the state after it, then what perfect instruments show
    before and after.
    """

    before: np.ndarray  # what perfect instruments show, (pieces, samples, channels)
    after: np.ndarray
    by_state: np.ndarray
    by_input: np.ndarray  # columns: commands, then pushes: forces on the coordinates, and on currents


@dataclass(frozen=True)
class Here:
    """Where a run is: its parameters, the starts of its pieces, its commands."""

    vector: np.ndarray
    starts: np.ndarray
    command: np.ndarray

    def is_at(self, *here: np.ndarray) -> bool:
        """True if vector, starts and command are still these."""
        return all(map(np.array_equal, here, (self.vector, self.starts, self.command)))


@dataclass(frozen=True)
class Point(Here):
    """What the intervals of a run were made linear about, and all slopes found there so far."""

    steps: Steps
    by_parameter: dict[int, np.ndarray]  # outcomes of the intervals, (pieces, samples, outcomes)


class Intervals:
    """The intervals of the pieces that gave a `response`, to be made linear there.

    `rough` (pieces, samples): where something sticks, turns or strikes.
    """

    def __init__(
        self,
        model: AssembledArm,
        channels: tuple[str, ...],
        pieces: Pieces,
        response: Response,
        rough: np.ndarray,
    ):
        self.model = model
        self.channels = channels
        self.pieces = pieces
        self.shape = rough.shape
        self.rough = np.flatnonzero(rough)
        moving, ends = response.states[..., : -len(channels)], response.end[:, None, : -len(channels)]
        following = np.concatenate([moving[:, 1:], ends], 1)
        parts = (moving, following, np.asarray(pieces.command), np.asarray(pieces.time))
        self.moments = Moments(*(part.reshape(rough.size, *part.shape[2:]) for part in parts))
        self.everywhere = np.arange(rough.size)

    def steps(self) -> Steps:
        """The intervals with their slopes by state and by what acts.

        Where the motion is not rough one in EVERY says what the others are, along straight lines.
        """
        moving, joints = self.moments.x.shape[-1], self.moments.command.shape[-1]
        sizes = (moving, joints, push_size(self.model))
        x, command, push = np.split(np.eye(sum(sizes)), np.cumsum(sizes)[:-1], axis=1)
        samples = self.shape[1]
        place = self.everywhere % samples
        some = np.flatnonzero((place % EVERY == 0) | (place == samples - 1))
        beside = np.clip(np.concatenate([self.rough - 1, self.rough, self.rough + 1]), 0, len(place) - 1)
        taken = np.union1d(some, beside)
        [table] = self._moved(taken, [Direction(None, x, command, push)])
        table = self._whole(_between(table, taken, self.everywhere))
        [[before, after]] = self._tables(self._readings, self.everywhere, [None])
        before, after = self._whole(before[..., 0]), self._whole(after[..., 0])
        return Steps(before, after, table[..., :moving], table[..., moving:])

    def by_bristles(self, tangents: list[Any]) -> list[np.ndarray]:
        """Slopes of the outcomes along groups of directions of the model's leaves, none where it is not rough."""
        found = []
        for some in self._moved(self.rough, [Direction(moved) for moved in tangents]):
            table = np.zeros((len(self.everywhere), *some.shape[1:]))
            table[self.rough] = some
            found.append(self._whole(table))
        return found

    def by_balance(self, tangents: list[Any], steps: Steps) -> list[np.ndarray]:
        """The same by what makes up for each, unless it changes how bristles bend."""
        tables = []
        for parts in self._tables(self._imbalance, self.everywhere, tangents):
            push, heating, before, after = map(self._whole, parts)
            with np.errstate(all="ignore"):  # a motion may be lost
                table = steps.by_input[..., -push.shape[2] :] @ push
            moving, joints, channels = steps.by_state.shape[-1], heating.shape[2], before.shape[2]
            table[:, :, moving - 2 * joints : moving - joints] += self.pieces.sample_time * heating
            table[:, :, moving : moving + channels] += before
            table[:, :, moving + channels :] += after
            tables.append(table)
        return tables

    def _whole(self, table: np.ndarray) -> np.ndarray:
        return table.reshape(*self.shape, *table.shape[1:])

    def _moved(self, places: np.ndarray, directions: list[Direction]) -> list[np.ndarray]:
        return [np.concatenate(parts, 1) for parts in self._tables(self._slopes, places, directions)]

    def _slopes(self, moments: Moments, direction: Direction) -> Interval:
        dt, stepping = self.pieces.sample_time, self.pieces.stepping
        return interval_slopes(self.model, self.channels, dt, stepping, moments, direction)

    def _imbalance(self, moments: Moments, direction: Any) -> Imbalance:
        return imbalance_slopes(self.model, self.channels, self.pieces.sample_time, moments, direction)

    def _readings(self, moments: Moments, _: None) -> tuple:
        return true_readings(self.model, self.channels, self.pieces.sample_time, moments)

    def _tables(
        self, kernel: Callable[[Moments, Any], Iterable], places: np.ndarray, directions: list[Any]
    ) -> list[list[np.ndarray]]:
        """What `kernel` gives at some moments along each of `directions`: tables `(moments, outcomes, lanes)`.

        It works on MOMENTS of them at a time, `(lanes, moments, outcomes)`.
        """
        count = max(len(places), 1)
        chunks = np.resize(places if len(places) else [0], (-(-count // MOMENTS), MOMENTS))

        def one(task):
            direction, chunk = task
            some = Moments(*(part[chunk] for part in self.moments))
            return [np.asarray(part) for part in kernel(some, direction)]

        def table(parts):
            whole = np.concatenate(parts, 1)[:, : len(places)]
            return np.ascontiguousarray(np.moveaxis(whole, 0, -1))

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            done = list(pool.map(one, itertools.product(directions, chunks)))
        whole = [done[k : k + len(chunks)] for k in range(0, len(done), len(chunks))]
        return [[table(parts) for parts in zip(*some, strict=True)] for some in whole]


def _between(table: np.ndarray, taken: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Rows of a table at the moments `wanted`, from those `taken`, along straight lines."""
    left = np.clip(np.searchsorted(taken, wanted, side="right") - 1, 0, len(taken) - 2)
    share = ((wanted - taken[left]) / (taken[left + 1] - taken[left]))[:, None, None]
    return (1 - share) * table[left] + share * table[left + 1]


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
