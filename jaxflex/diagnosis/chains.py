"""Pieces joined end to end over a horizon, the starts of all eliminated.

Within a chain the starts of all pieces but the first follow from it through the linearised
motion; the first is free. Slopes are joined once and serve as long as they do: what changes
at every step of a fit are residuals and gaps.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.signal import lfilter

from .normal import Normal, solve_all

LOST = 1e100  # beyond it a motion, or its slope, has left all bounds


@dataclass
class Linearised:
    """A run made linear about its pieces: residuals and slopes in units of the noise."""

    residual: np.ndarray  # (pieces, samples, channels)
    by_start: np.ndarray  # (pieces, samples, channels, states)
    by_column: np.ndarray  # (pieces, samples, channels, columns)
    end_by_start: np.ndarray  # (pieces, states, states)
    end_by_column: np.ndarray  # (pieces, states, columns)
    gap: np.ndarray  # (pieces, states): where a piece ends, less where the next begins
    joined: dict[int, "list[Chains]"] = field(default_factory=dict)  # by horizon


@dataclass(frozen=True)
class Chains:
    """Chains of equally many pieces: starts and readings by the first start, then by the columns."""

    pieces: np.ndarray  # (chains, length): which pieces
    by_start: np.ndarray  # (chains, length, states, states)
    by_column: np.ndarray  # (chains, length, states, columns)
    table: np.ndarray  # (chains, readings, states + columns), whitened
    gram: np.ndarray  # (chains, states + columns, states + columns)
    bounded: bool  # False where slopes left all bounds


@dataclass(frozen=True)
class Joined:
    """What gives the starts of all pieces of some chains once a step of the columns is known."""

    chains: Chains
    offset: np.ndarray  # (chains, length, states)
    solved: np.ndarray  # (chains, states, columns + 1)

    def move(self, starts: np.ndarray, step: np.ndarray) -> None:
        """Move `starts` as a step of the columns asks."""
        first = self.solved[:, :, -1] - self.solved[:, :, :-1] @ step
        moved = (self.chains.by_start @ first[:, None, :, None])[..., 0]
        starts[self.chains.pieces] += moved + self.chains.by_column @ step + self.offset


def join(linear: Linearised, horizon: int, colour: Sequence[np.ndarray]) -> list[Chains]:
    """The run's pieces in chains of about `horizon`; `colour`: the whitening filter of each channel."""
    if horizon not in linear.joined:
        count = len(linear.residual)
        cuts = np.linspace(0, count, max(round(count / horizon), 1) + 1).round().astype(int)
        spans = [range(first, last) for first, last in itertools.pairwise(np.unique(cuts))]
        lengths = sorted({len(span) for span in spans})
        linear.joined[horizon] = [
            _joined(linear, np.array([span for span in spans if len(span) == length]), colour)
            for length in lengths
        ]
    return linear.joined[horizon]


def _joined(linear: Linearised, pieces: np.ndarray, colour: Sequence[np.ndarray]) -> Chains:
    count, states, columns = len(pieces), linear.gap.shape[1], linear.by_column.shape[-1]
    by_start = np.broadcast_to(np.eye(states), (count, states, states))
    by_column = np.zeros((count, states, columns))
    starts, slopes, rows = [], [], []
    for at in pieces.T:
        starts.append(by_start)
        slopes.append(by_column)
        rows.append(
            np.concatenate(
                [linear.by_start[at] @ by_start[:, None],
                 linear.by_column[at] + linear.by_start[at] @ by_column[:, None]], -1,
            )
        )  # fmt: skip
        through = linear.end_by_start[at]
        by_start, by_column = through @ by_start, through @ by_column + linear.end_by_column[at]
    table = whitened(np.concatenate(rows, 1), colour).reshape(count, -1, states + columns)
    gram = table.transpose(0, 2, 1) @ table
    return Chains(pieces, np.stack(starts, 1), np.stack(slopes, 1), table, gram, _bounded(table))


def whitened(rows: np.ndarray, colour: Sequence[np.ndarray]) -> np.ndarray:
    """Rows `(chains, samples, channels, …)`, filtered along the samples in place."""
    for c, filter_ in enumerate(colour):
        if len(filter_) > 1:
            rows[:, :, c] = lfilter(filter_, [1.0], rows[:, :, c], axis=1)
    return rows


def condense(
    linear: Linearised,
    valid: np.ndarray,
    horizon: int,
    colour: Sequence[np.ndarray],
    spread: np.ndarray,
    damping: float = 0.0,
) -> Normal:
    """Least squares in the columns, over horizons of `horizon` pieces, starts eliminated.

    `valid` (pieces, samples) readings; `spread` of a start about its guess; `damping` of the
    starts, as a share of what the readings say of them.
    """
    columns, states = linear.by_column.shape[-1], linear.gap.shape[1]
    readings = int(valid.sum()) * linear.residual.shape[2]
    total = Normal(np.zeros((columns, columns)), np.zeros(columns), 0.0, 0.0, readings)
    a, b = slice(0, states), slice(states, states + columns)
    with np.errstate(all="ignore"):  # a motion may be lost
        for chains in join(linear, horizon, colour):
            residual, offset = _along(linear, chains, colour)
            if not (chains.bounded and _bounded(residual)):
                total.cost = np.inf
                return total
            gram, right = chains.gram, (residual[:, None] @ chains.table)[:, 0]
            inner = gram[:, a, a] + np.diag(1 / spread**2)
            inner += damping * np.diagonal(inner, axis1=1, axis2=2)[:, None] * np.eye(states)
            solved = solve_all(inner, np.concatenate([gram[:, a, b], right[:, a, None]], -1))
            across = gram[:, b, a]
            total = total + Normal(
                (gram[:, b, b] - across @ solved[:, :, :-1]).sum(0),
                (right[:, b] - (across @ solved[:, :, -1:])[..., 0]).sum(0),
                float(np.sum(residual**2)),
                float(np.sum(right[:, a] * solved[:, :, -1])),
                0,
                [Joined(chains, offset, solved)],
            )
    return total


def _along(linear: Linearised, chains: Chains, colour: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Whitened residuals `(chains, readings)` with gaps closed, and by how much each start is moved for that."""
    offset = np.zeros((len(chains.pieces), linear.gap.shape[1]))
    rows, offsets = [], []
    for at in chains.pieces.T:
        offsets.append(offset)
        rows.append(linear.residual[at] - (linear.by_start[at] @ offset[:, None, :, None])[..., 0])
        offset = (linear.end_by_start[at] @ offset[..., None])[..., 0] + linear.gap[at]
    residual = whitened(np.concatenate(rows, 1), colour)
    return residual.reshape(len(residual), -1), np.stack(offsets, 1)


def _bounded(values: np.ndarray) -> bool:
    return bool(np.abs(values).max(initial=0.0) < LOST)  # false for what is not a number
