"""Which effect would explain what is left: a score test of every candidate at once."""

# arrays of numpy go to JAX and come back, which its annotations do not foresee
# pyright: reportArgumentType=false, reportOptionalMemberAccess=false

from dataclasses import dataclass

import numpy as np

from .catalogue import Candidate, Motion
from .chains import Linearised
from .normal import Normal, solve
from .runs import Run
from .shooting import Problem


@dataclass(frozen=True)
class Score:
    """What adding a candidate would gain, to first order.

    `gain`: fall of the cost (misfit and prior, in units of the noise); `step`: its
    amplitudes; `survival`: the share of the candidate's response that no nominal
    parameter can imitate.
    """

    candidate: Candidate
    gain: float
    step: tuple[float, ...]
    survival: float


def with_candidates(
    problem: Problem,
    run: Run,
    motion: Motion,
    vector: np.ndarray,
    columns: list[int],
    candidates: list[Candidate],
) -> tuple[Linearised, list[slice]]:
    """A run made linear in the parameters at `columns`, then in every candidate's amplitudes.

    `motion`: what the model predicts for the run at `vector`.
    """
    parameters = problem.setting.parameters
    forcings, inside, order = [], [], []
    for candidate in candidates:
        forcing = motion.forcing(candidate)
        if forcing is None:
            at = [parameters.position(*candidate.key, name) for name in candidate.amplitudes]
            order.append((True, len(inside), len(at)))
            inside += at
        else:
            first = sum(len(f) for f in forcings)
            order.append((False, first, len(forcing)))
            forcings.append(forcing)
    everything = [*columns, *inside]
    linear = problem.linearise(run, vector, everything, np.concatenate(forcings) if forcings else None)
    places = [
        slice(len(columns) + first, len(columns) + first + count)
        if by_parameter
        else slice(len(everything) + first, len(everything) + first + count)
        for by_parameter, first, count in order
    ]
    return linear, places


def scores(
    normal: Normal,
    prior: np.ndarray,
    pull: np.ndarray,
    columns: int,
    candidates: list[Candidate],
    places: list[slice],
) -> list[Score]:
    """Every candidate on top of the first `columns`, which have `prior` precision and are pulled by `pull`."""
    base = slice(0, columns)
    matrix = normal.matrix[base, base] + np.diag(prior)
    vector = normal.vector[base] + pull
    found = []
    with np.errstate(all="ignore"):  # slopes of a lost motion have no bounds
        solved = solve(matrix, np.column_stack([normal.matrix[base], vector]))
        for candidate, place in zip(candidates, places, strict=True):
            cross = normal.matrix[place, base]
            own = normal.matrix[place, place]
            inner = own - cross @ solved[:, :-1][:, place]
            right = normal.vector[place] - cross @ solved[:, -1]
            scale = np.sqrt(np.maximum(np.diag(own), 1e-300))
            tidy = inner / np.outer(scale, scale) + 1e-9 * np.eye(len(scale))
            if not np.isfinite(tidy).all():
                continue
            step = np.linalg.pinv(tidy, hermitian=True) / np.outer(scale, scale) @ right
            gain = float(right @ step)
            if not np.isfinite(gain):
                continue
            survival = float(np.sqrt(np.clip(np.diag(tidy), 0, None).max()))
            found.append(Score(candidate, gain, tuple(step), survival))
    return found
