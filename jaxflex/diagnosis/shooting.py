"""Gauss-Newton over pieces joined end to end: multiple shooting with continuity condensed away.

Within a horizon the starts of all pieces but the first follow from it through the
linearised motion; the first is free and is eliminated. What is left is a small least
squares problem in the parameters, the same for a horizon of a tenth of a second and for
a whole run (Bock's direct multiple shooting).
"""

# arrays of numpy go to JAX and come back, which its annotations do not foresee
# pyright: reportArgumentType=false, reportOptionalMemberAccess=false

import dataclasses
import itertools
import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.signal import lfilter

from ..arm.arm import Arm
from .parameters import Parameters
from .plant import Direction, Instruments, Pieces, Response, respond, slopes

LOST = 1e100  # beyond it a motion, or its slope, has left all bounds
SLOPE_SUBSTEPS = 4  # enough for slopes, which chord steps make up for
LANES = 12  # directions differentiated side by side: one compiled program whatever their number


@dataclass
class Run:
    """A recording cut into pieces, with the states its pieces start from."""

    times: np.ndarray  # (samples,)
    command: np.ndarray  # (samples, joints), as logged
    reading: np.ndarray  # (pieces, samples, channels)
    valid: np.ndarray  # (pieces, samples)
    starts: np.ndarray  # (pieces, states)

    @property
    def pieces(self) -> int:
        """Number of pieces."""
        return self.reading.shape[0]


@dataclass
class Setting:
    """All that stays fixed during a diagnosis."""

    parameters: Parameters
    channels: tuple[str, ...]
    noise: np.ndarray  # standard deviation of each channel
    colour: list[np.ndarray]  # coefficients of the whitening filter of each channel, first one 1
    sample_time: float
    length: int  # samples in a piece
    substeps: int
    start_spread: np.ndarray  # how far a start may be from what was guessed, (states,)


@dataclass
class Linearised:
    """A run made linear about its pieces: residuals and slopes in units of the noise."""

    residual: np.ndarray  # (pieces, samples, channels)
    by_start: np.ndarray  # (pieces, samples, channels, states)
    by_column: np.ndarray  # (pieces, samples, channels, columns)
    end_by_start: np.ndarray  # (pieces, states, states)
    end_by_column: np.ndarray  # (pieces, states, columns)
    gap: np.ndarray  # (pieces, states): where a piece ends, less where the next begins


@dataclass
class Normal:
    """Least squares in the columns alone, the starts eliminated: `N d = g`.

    `cost` is that of the starts and columns as they are.
    """

    matrix: np.ndarray
    vector: np.ndarray
    cost: float
    count: int
    back: list = field(default_factory=list)  # what gives the starts once d is known

    def __add__(self, other: "Normal") -> "Normal":
        return Normal(
            self.matrix + other.matrix,
            self.vector + other.vector,
            self.cost + other.cost,
            self.count + other.count,
            [*self.back, *other.back],
        )


def solve(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """`matrix^-1 right` of a symmetric matrix, or the smallest of its solutions where it is singular."""
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    tidy = matrix / np.outer(scale, scale)
    tall = (right.T / scale).T
    try:
        found = np.linalg.solve(tidy, tall)
    except np.linalg.LinAlgError:
        found = np.full_like(tall, np.nan)
    if not np.isfinite(found).all():
        if not np.isfinite(tidy).all() or not np.isfinite(tall).all():
            return np.full_like(tall, np.inf)
        found = np.linalg.lstsq(tidy, tall, rcond=1e-13)[0]
    return (found.T / scale).T


def delayed(times: np.ndarray, command: np.ndarray, delay: float, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """A command held between samples, as its mean over each interval when late by `delay` [s]; and its slope."""
    knots = np.append(times, times[-1] + dt)
    area = np.concatenate([[0.0], np.cumsum(command) * dt])
    first = command[0]

    def upto(t):
        return np.where(t < knots[0], first * (t - knots[0]), np.interp(t, knots, area))

    def at(t):
        index = np.clip(np.floor((t - knots[0]) / dt + 1e-9).astype(int), 0, len(command) - 1)
        return command[index]

    mean = (upto(knots[1:] - delay) - upto(knots[:-1] - delay)) / dt
    # the slope just above the delay: at no delay the interval begins to see the command before
    slope = -(at(knots[1:] - delay - 1e-9 * dt) - at(knots[:-1] - delay - 1e-9 * dt)) / dt
    return mean, slope


@eqx.filter_jit
def _assembled_along(arm: Arm, directions: Any) -> Any:
    arrays, static = eqx.partition(arm, eqx.is_inexact_array)

    def assembled(arrays):
        return eqx.filter(eqx.combine(arrays, static).assemble(), eqx.is_inexact_array)

    return jax.vmap(lambda d: jax.jvp(assembled, (arrays,), (d,))[1])(directions)


class Problem:
    """What turns runs and parameters into least squares."""

    def __init__(self, setting: Setting):
        self.setting = setting
        self._delay = [
            next(
                (
                    len(setting.parameters.nominal) + i
                    for i, part in enumerate(setting.parameters.effect)
                    if part.effect == "input_delay" and part.location == f"joint_{joint + 1}"
                ),
                None,
            )
            for joint in range(len(setting.parameters.arm.joints))
        ]

    def substeps(self, vector: np.ndarray) -> int:
        """Integration steps in a sample interval for these parameters."""
        s = self.setting
        return s.parameters.substeps(vector, s.sample_time, s.substeps)

    def arm(self, vector: np.ndarray, substeps: int) -> Arm:
        """The arm as it is integrated in so many steps a sample."""
        step = self.setting.sample_time / substeps
        return self.setting.parameters.build(jnp.asarray(vector), step)

    def _tangents(self, vector: np.ndarray, directions: np.ndarray, substeps: int) -> Any:
        step, at = self.setting.sample_time / substeps, jnp.asarray(vector)

        def along(direction):
            moved = jax.jvp(lambda v: self.setting.parameters.build(v, step), (at,), (direction,))[1]
            return eqx.filter(moved, eqx.is_inexact_array)

        return _assembled_along(self.arm(vector, substeps), jax.vmap(along)(jnp.asarray(directions)))

    def instruments(self, vector: np.ndarray) -> Instruments:
        """The instruments that a parameter vector stands for."""
        values = {"sensor_gain": [], "sensor_bias": [], "sensor_drift": [], "sensor_lag": []}
        found = {
            (part.effect, part.location): vector[len(self.setting.parameters.nominal) + i]
            for i, part in enumerate(self.setting.parameters.effect)
        }
        for name in self.setting.channels:
            for kind, entries in values.items():
                entries.append(found.get((kind, name), 0.0))
        gain, bias, drift, lag = (np.array(v, dtype=float) for v in values.values())
        return Instruments(1 + gain, bias, drift, lag)

    def pieces(self, run: Run, vector: np.ndarray, substeps: int) -> tuple[Pieces, np.ndarray]:
        """The pieces of a run under the delays of `vector`, and the slope of commands with delay."""
        s = self.setting
        columns, rates = [], []
        for joint in range(run.command.shape[1]):
            at = self._delay[joint]
            delay = 0.0 if at is None else float(vector[at])
            mean, slope = delayed(run.times, run.command[:, joint], delay, s.sample_time)
            columns.append(mean)
            rates.append(slope)
        shape = (run.pieces, s.length)
        total = run.pieces * s.length

        def cut(values):
            return np.pad(values, (0, total - len(values)), mode="edge").reshape(shape)

        time = run.times[0] + np.arange(total).reshape(shape) * s.sample_time
        command = np.stack([cut(c) for c in columns], -1)
        slope = np.stack([cut(c) for c in rates], -1)
        return Pieces(jnp.asarray(command), jnp.asarray(time), s.sample_time, jnp.asarray(substeps)), slope

    def predict(self, run: Run, vector: np.ndarray) -> Response:
        """What the pieces of a run show from their starts."""
        substeps = self.substeps(vector)
        model = self.arm(vector, substeps).assemble()
        pieces, _ = self.pieces(run, vector, substeps)
        found = respond(
            model, self.instruments(vector), self.setting.channels, jnp.asarray(run.starts), pieces
        )
        return Response(*(np.asarray(part) for part in found))

    def linearise(
        self, run: Run, vector: np.ndarray, columns: list[int], forcing: np.ndarray | None = None
    ) -> Linearised:
        """A run about its starts and `vector`, with slopes by the parameters at `columns`.

        `forcing`: `(more, pieces, samples, joints + coordinates)` of further columns, each a
        sequence of changes of the commands and of forces on the coordinates.
        """
        s = self.setting
        substeps = min(self.substeps(vector), max(SLOPE_SUBSTEPS, s.substeps))
        model = self.arm(vector, substeps).assemble()
        instruments = self.instruments(vector)
        pieces, delay_slope = self.pieces(run, vector, substeps)
        states, joints, size = run.starts.shape[1], run.command.shape[1], model.size
        more = 0 if forcing is None else len(forcing)
        total = states + len(columns) + more
        lanes = -(-total // LANES) * LANES
        start = np.zeros((lanes, states))
        start[np.arange(states), np.arange(states)] = 1.0
        unit = np.zeros((lanes, len(vector)))
        command = np.zeros((lanes, run.pieces, s.length, joints))
        force = np.zeros((lanes, run.pieces, s.length, size))
        delays = {at: joint for joint, at in enumerate(self._delay) if at is not None}
        for k, column in enumerate(columns):
            unit[states + k, column] = 1.0
            if column in delays:
                command[states + k, :, :, delays[column]] = delay_slope[..., delays[column]]
        if forcing is not None:
            command[states + len(columns) : total] = forcing[..., :joints]
            force[states + len(columns) : total] = forcing[..., joints:]

        def some(first):
            part = slice(first, first + LANES)
            arrays = self._tangents(vector, unit[part], substeps)
            moved = self._instruments_along(unit[part])
            direction = Direction(
                arrays, moved, jnp.asarray(start[part, None, :]), jnp.asarray(command[part]),
                jnp.asarray(force[part]),
            )  # fmt: skip
            found = slopes(model, instruments, s.channels, jnp.asarray(run.starts), pieces, direction)
            return np.asarray(found.reading), np.asarray(found.end)

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            readings, ends = zip(*pool.map(some, range(0, lanes, LANES)), strict=True)
        reading = np.moveaxis(np.concatenate(readings)[:total], 0, -1) / s.noise[:, None]
        end = np.moveaxis(np.concatenate(ends)[:total], 0, -1)
        residual, gap = self._misfit(run, vector)
        reading = np.where(run.valid[..., None, None], reading, 0.0)
        return Linearised(
            residual, reading[..., :states], reading[..., states:], end[..., :states], end[..., states:], gap
        )

    def _misfit(self, run: Run, vector: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residual of every reading in units of the noise, and the gap after every piece."""
        response = self.predict(run, vector)
        residual = (run.reading - response.reading) / self.setting.noise
        gap = np.zeros_like(run.starts)
        gap[:-1] = response.end[:-1] - run.starts[1:]
        return np.where(run.valid[..., None], residual, 0.0), gap

    def _instruments_along(self, unit: np.ndarray) -> Instruments:
        zero = self.instruments(np.zeros(unit.shape[1]))
        rows = [self.instruments(row) for row in unit]
        return Instruments(*(np.stack([r[k] - zero[k] for r in rows]) for k in range(4)))

    def condense(self, run: Run, linear: Linearised, horizon: int, damping: float = 0.0) -> Normal:
        """Least squares in the columns, over horizons of `horizon` pieces, starts eliminated.

        `damping` of the starts, as a share of what the readings say of them.
        """
        s = self.setting
        columns = linear.by_column.shape[-1]
        states = run.starts.shape[1]
        total = Normal(np.zeros((columns, columns)), np.zeros(columns), 0.0, 0)
        cuts = np.unique(
            np.linspace(0, run.pieces, max(round(run.pieces / horizon), 1) + 1).round().astype(int)
        )
        for first, last in itertools.pairwise(cuts):
            by_start, by_column, offset = np.eye(states), np.zeros((states, columns)), np.zeros(states)
            rows, kept = [], []
            for j in range(first, last):
                kept.append((j, by_start, by_column, offset))
                slope = linear.by_start[j]
                rows.append(
                    np.concatenate(
                        [slope @ by_start, linear.by_column[j] + slope @ by_column,
                         (linear.residual[j] - slope @ offset)[..., None]], -1,
                    )
                )  # fmt: skip
                through = linear.end_by_start[j]
                by_start, by_column = through @ by_start, through @ by_column + linear.end_by_column[j]
                offset = through @ offset + linear.gap[j]
            table = np.concatenate(rows)
            if not np.isfinite(table).all() or np.abs(table).max() > LOST:
                total.cost = np.inf
                return total
            for c, filter_ in enumerate(s.colour):
                if len(filter_) > 1:
                    table[:, c] = lfilter(filter_, [1.0], table[:, c], axis=0)
            table = table.reshape(-1, states + columns + 1)
            gram = table.T @ table
            a = slice(0, states)
            b = slice(states, states + columns)
            inner = gram[a, a] + np.diag(1 / s.start_spread**2 + damping * np.diag(gram[a, a]))
            solved = solve(inner, gram[a, states:])
            total = total + Normal(
                gram[b, b] - gram[b, a] @ solved[:, :-1],
                gram[b, -1] - gram[b, a] @ solved[:, -1],
                gram[-1, -1],
                int(run.valid[first:last].sum()) * len(s.channels),
                [(run, kept, solved)],
            )
        return total

    def move_starts(self, normal: Normal, step: np.ndarray) -> None:
        """Move the starts of all pieces as a step of the columns asks."""
        for run, kept, solved in normal.back:
            first = solved[:, -1] - solved[:, :-1] @ step
            for j, by_start, by_column, offset in kept:
                run.starts[j] = run.starts[j] + by_start @ first + by_column @ step + offset

    def refresh(self, run: Run, vector: np.ndarray, linear: Linearised) -> Linearised:
        """The same slopes about where the run is now."""
        residual, gap = self._misfit(run, vector)
        return dataclasses.replace(linear, residual=residual, gap=gap)
