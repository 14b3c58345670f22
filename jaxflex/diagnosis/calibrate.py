"""Fit parameters within their uncertainty: Gauss-Newton with chord steps, damped where it must be."""

# arrays of numpy go to JAX and come back, which its annotations do not foresee
# pyright: reportArgumentType=false, reportOptionalMemberAccess=false

from dataclasses import dataclass

import numpy as np

from .shooting import Linearised, Normal, Problem, Run, solve

CHORDS = 5  # steps with the same slopes; each needs only a run of the model
MOST = 15  # iterations, however well they do
SLOW = 0.03  # share of the cost that an iteration has to gain to be followed by more than was asked for
STEEPEST = 1e4  # damping beyond which a fit has nowhere to go


@dataclass(frozen=True)
class Freedom:
    """The parameters that a fit moves: their places, with the prior and the bounds of each."""

    columns: tuple[int, ...]
    precision: np.ndarray
    centre: np.ndarray
    lowest: np.ndarray


@dataclass
class Fit:
    """Where a fit has come to: parameters, cost (misfit and prior), and the slopes it ended with."""

    vector: np.ndarray
    freedom: Freedom
    cost: float
    prior: float
    normal: Normal

    @property
    def count(self) -> int:
        """Number of readings."""
        return self.normal.count

    @property
    def level(self) -> float:
        """Misfit a reading, in units of the noise: 1 is the noise floor."""
        return (self.cost - self.prior) / self.count if np.isfinite(self.cost) else np.inf


def fit(
    problem: Problem,
    runs: list[Run],
    vector: np.ndarray,
    freedom: Freedom,
    horizon: int,
    iterations: int = 4,
    tolerance: float = 3e-4,
) -> Fit:
    """Minimise misfit over `horizon` pieces plus prior; the starts of the pieces move along.

    Ends when an iteration gains less than `tolerance` a reading, or, after `iterations`
    of them, less than the share SLOW of the cost.
    """
    vector = vector.copy()
    columns = list(freedom.columns)

    def prior(v):
        return float(freedom.precision @ (v[columns] - freedom.centre) ** 2)

    def condensed(linears: list[Linearised]) -> Normal:
        parts = [problem.condense(r, part, horizon, damping) for r, part in zip(runs, linears, strict=True)]
        return sum(parts[1:], parts[0])

    def keep(cost, normal):
        return cost, normal, vector.copy(), [run.starts.copy() for run in runs]

    def restore(kept):
        vector[:] = kept[2]
        for run, starts in zip(runs, kept[3], strict=True):
            run.starts = starts.copy()

    damping = 0.0
    kept = None
    for iteration in range(MOST):
        linears = [problem.linearise(run, vector, columns) for run in runs]
        first = condensed(linears)
        kept = keep(first.cost + prior(vector), first)
        before = kept[0]
        if not np.isfinite(before):
            break
        while damping < STEEPEST:
            current, cost = first, before
            for _ in range(CHORDS):
                matrix = current.matrix + np.diag(freedom.precision)
                matrix = matrix + damping * np.diag(np.diag(matrix) + 1e-300)
                pull = current.vector - freedom.precision * (vector[columns] - freedom.centre)
                step = solve(matrix, pull) if columns else np.zeros(0)
                if not np.isfinite(step).all():
                    cost = np.inf
                    break
                step = np.maximum(vector[columns] + step, freedom.lowest) - vector[columns]
                problem.move_starts(current, step)
                vector[columns] += step
                with np.errstate(all="ignore"):
                    current = condensed(
                        [problem.refresh(r, vector, part) for r, part in zip(runs, linears, strict=True)]
                    )
                new = current.cost + prior(vector)
                if not np.isfinite(new):
                    cost = np.inf
                    break
                settled = abs(cost - new) < 0.1 * tolerance * current.count
                cost = new
                if cost < kept[0]:
                    kept = keep(cost, current)
                if settled or cost > 100 * before:
                    break
            if kept[0] < before:
                damping = damping / 10 if damping > 1e-4 else 0.0
                break
            restore(kept)
            damping = max(10 * damping, 1e-4)
            first = condensed(linears)
        restore(kept)
        gain = before - kept[0]
        if gain < tolerance * first.count or (iteration + 1 >= iterations and gain < SLOW * before):
            break
    assert kept is not None
    return Fit(vector, freedom, kept[0], prior(vector), kept[1])
