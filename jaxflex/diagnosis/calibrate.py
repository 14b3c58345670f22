"""Fit parameters within their uncertainty: Gauss-Newton with chord steps, damped where it must be."""

# arrays of numpy go to JAX and come back, which its annotations do not foresee
# pyright: reportArgumentType=false, reportOptionalMemberAccess=false

import dataclasses
from dataclasses import dataclass

import numpy as np

from .chains import Linearised
from .normal import Normal, solve
from .runs import Run
from .shooting import Problem

CHORDS = 5  # steps with the same slopes; each needs only a run of the model
MOST = 15  # iterations, however well they do
FAITHFUL = 0.1  # of a fall of the cost: slopes that foretell it better than that need no renewal
SLOW = 0.03  # share of the cost that an iteration has to gain to be followed by more than was asked for
WALL = 25.0  # steepness of a prior beyond what it allows, in its own precision
RAN_AWAY = 4.0  # growth of the misfit of a piece in one step
BELIED = 1.5  # growth of the cost over an iteration, as the next slopes see it, at which it is taken back
REFUSALS = 3  # in a row, at which a fit ends
ANEW = 4.0  # misfit of a piece, and times that of most: it may have settled on the wrong side of a friction
ENOUGH = 3  # iterations of a fit that is to end where nothing more is gained
MUCH = 0.3  # of all misfit: what such pieces must have to begin anew
ROUNDS = 2  # in which they do
STEEPEST = 1e4  # damping beyond which a fit has nowhere to go


@dataclass(frozen=True)
class Freedom:
    """The parameters that a fit moves: their places, with the prior and the bounds of each.

    A prior is normal, `precision (v - centre)^2`, and steep beyond `far` standard deviations.
    """

    columns: tuple[int, ...]
    precision: np.ndarray
    centre: np.ndarray
    lowest: np.ndarray
    far: np.ndarray

    @staticmethod
    def full(columns: list[int]) -> "Freedom":
        """Of parameters without prior or bounds."""
        zero = np.zeros(len(columns))
        return Freedom(tuple(columns), zero, zero, zero - np.inf, zero + np.inf)

    def prior(self, vector: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        """Cost of the prior, its pull on the parameters, and its precision, where they are."""
        off = vector[list(self.columns)] - self.centre
        edge = self.far / np.sqrt(np.maximum(self.precision, 1e-300))
        beyond = np.sign(off) * np.maximum(np.abs(off) - edge, 0.0)
        wall = WALL * self.precision
        cost = float(self.precision @ off**2 + wall @ beyond**2)
        return cost, -self.precision * off - wall * beyond, self.precision + wall * (beyond != 0)


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
    fresh: bool = False,
    most: int = MOST,
) -> Fit:
    """Minimise misfit over `horizon` pieces plus prior; the starts of the pieces move along.

    Slopes of an earlier fit serve as long as they foretell how far the cost falls; with
    `fresh`, they are taken anew at the end; with `most` of 1 they are never. Ends when slopes
    that hold have nothing more to gain, when an iteration gains less than `tolerance` a reading,
    or, after `iterations` of them, less than the share SLOW of the cost. Pieces that run away in
    a step stay where they were; over longer horizons, whose cost rests on the slopes, an iteration
    that the next slopes belie is taken back and tried again with more damping. Pieces that dry
    friction leaves astray at the end begin anew.
    """
    found = _descended(problem, runs, vector, freedom, horizon, iterations, tolerance, fresh, most)
    if horizon > 1 or min(iterations, most) < ENOUGH:
        return found
    for _ in range(ROUNDS):
        if not any([begun_anew(problem, run, found.vector) for run in runs]):
            break
        before = found.cost
        found = _descended(problem, runs, found.vector, freedom, 1, iterations, tolerance, fresh, most)
        if not found.cost < (1 - SLOW) * before:
            break
    return found


def settle(problem: Problem, runs: list[Run], vector: np.ndarray, horizon: int = 1) -> Fit:
    """The starts of all pieces of these runs fitted alone, parameters held."""
    return fit(problem, runs, vector, Freedom.full([]), horizon, 2)


def begun_anew(problem: Problem, run: Run, vector: np.ndarray) -> bool:
    """Start pieces that went astray under dry friction from what their readings tell; true if any fits better so.

    Where a joint sticks and turns, what a start leaves has more than one valley.
    """
    if not problem.setting.parameters.has_dry_friction(vector):
        return False
    here = problem.misfit(run, problem.predict(run, vector))
    astray = here > ANEW * max(1.0, float(np.median(here)))
    if not here[astray].sum() > MUCH * here.sum():
        return False
    starts = np.where(astray[:, None], run.measured, run.starts)
    other = dataclasses.replace(run, starts=starts, slopes=None)
    _descended(problem, [other], vector, Freedom.full([]), 1, 2)
    better = astray & (problem.misfit(other, problem.predict(other, vector)) < here)
    run.starts = np.where(better[:, None], other.starts, run.starts)
    return bool(better.any())


def _descended(
    problem: Problem,
    runs: list[Run],
    vector: np.ndarray,
    freedom: Freedom,
    horizon: int,
    iterations: int,
    tolerance: float = 3e-4,
    fresh: bool = False,
    most: int = MOST,
) -> Fit:
    """The fit, pieces left where they went."""
    vector = vector.copy()
    columns = list(freedom.columns)

    def prior(v):
        return freedom.prior(v)[0]

    def condensed(linears: list[Linearised]) -> Normal:
        parts = [problem.condense(r, part, horizon, damping) for r, part in zip(runs, linears, strict=True)]
        return sum(parts[1:], parts[0])

    def keep(cost, normal):
        return float(cost), normal, vector.copy(), [run.starts.copy() for run in runs]

    def restore(kept):
        vector[:] = kept[2]
        for run, starts in zip(runs, kept[3], strict=True):
            run.starts = starts.copy()

    def chords(kept, first, linears, damping):
        """Steps with the same slopes; the best place so far, what the first promised, and whether they settled."""
        before = cost = kept[0]
        current, shown, promise, settled = first, linears, np.inf, False
        for chord in range(CHORDS):
            _, pull, precision = freedom.prior(vector)
            matrix, pull = current.matrix + np.diag(precision), current.vector + pull
            matrix = matrix + damping * np.diag(np.diag(matrix) + 1e-300)
            step = bounded(matrix, pull, freedom.lowest - vector[columns])
            if not np.isfinite(step).all():
                break
            if chord == 0:
                promise = current.promise + float(pull @ step)
            here = [run.starts.copy() for run in runs]
            problem.move_starts(current, step)
            vector[columns] += step
            with np.errstate(all="ignore"):
                before_step = shown
                shown = [problem.refresh(r, vector, part) for r, part in zip(runs, linears, strict=True)]
                if horizon == 1:
                    shown = [
                        held_back(problem, run, vector, *parts)
                        for run, *parts in zip(runs, here, before_step, shown, strict=True)
                    ]
                current = condensed(shown)
            new = current.cost + prior(vector)
            if not np.isfinite(new):
                break
            settled = abs(cost - new) < 0.1 * tolerance * current.count
            cost = new
            if cost < kept[0]:
                kept = keep(cost, current)
            if settled or cost > 100 * before:
                break
        return kept, promise, settled

    damping = 0.0
    kept = best = None
    refused = 0
    renew = False
    for iteration in range(most):
        for run in runs:
            problem.bend(run, vector)
        linears = [problem.linearise(run, vector, columns, fresh=renew) for run in runs]
        first = condensed(linears)
        kept = keep(first.cost + prior(vector), first)
        if best is not None and not kept[0] < BELIED * best[0][0]:
            kept, first, linears = best  # slopes there say that the last step was none
            restore(kept)
            refused += 1
            if refused == REFUSALS:
                break
            damping = max(100 * damping, 1e-2)
        elif renew:
            best, refused = (kept, first, linears), 0
        before, promise, settled = kept[0], np.inf, False
        while np.isfinite(before) and damping < STEEPEST:
            kept, promise, settled = chords(kept, first, linears, damping)
            if kept[0] < before:
                damping = damping / 10 if damping > 1e-4 else 0.0
                break
            restore(kept)
            if settled:
                break
            damping = max(10 * damping, 1e-4)
            first = condensed(linears)
        restore(kept)
        gain = before - kept[0]
        if gain == 0:
            damping = 0.0  # of slopes that did not hold
        if iteration < iterations and any([problem.mend(run, vector) for run in runs]):
            renew, best = True, None
            continue
        small = tolerance * first.count
        held = settled and abs(promise - gain) < max(FAITHFUL * gain, small)
        if held or (renew and not np.isfinite(before)):
            break
        if renew and (gain < small or (iteration + 1 >= iterations and gain < SLOW * before)):
            break
        renew = True
    assert kept is not None
    normal = kept[1]
    if fresh:
        linears = [problem.linearise(run, vector, columns) for run in runs]
        damping = 0.0
        normal = condensed(linears)
    return Fit(vector, freedom, kept[0], prior(vector), normal)


def bounded(matrix: np.ndarray, pull: np.ndarray, least: np.ndarray) -> np.ndarray:
    """The step that solves `matrix step = pull` with no entry below `least`: those that would be stay there."""
    free = np.ones(len(pull), dtype=bool)
    while True:
        rest = pull[free] - matrix[np.ix_(free, ~free)] @ least[~free]
        step = np.where(free, 0.0, least)
        step[free] = solve(matrix[np.ix_(free, free)], rest)
        below = free & (step < least)
        if not below.any():
            return step
        free &= ~below


def held_back(
    problem: Problem,
    run: Run,
    vector: np.ndarray,
    starts: np.ndarray,
    before: Linearised,
    now: Linearised,
) -> Linearised:
    """What the run shows `now`, after a step from `starts`, with pieces that ran away put back to there.

    One piece says nothing of the next, and need not spoil a step that suits the others.
    """
    were, are = (np.mean(part.residual**2, (1, 2)) for part in (before, now))
    away = ~(are < RAN_AWAY * (1 + were))
    if not away.any():
        return now
    run.starts[away] = starts[away]
    return problem.refresh(run, vector, now)
