"""Which experiment would tell two effects apart: their separation, computed from the model.

An experiment separates i from j by `D = 1/2 |(I - P) S_i d_i|^2`: half the squared response
of effect i, in units of the noise, that no nominal parameter, no start and no size of
effect j can imitate. Ten is plenty; below one the two look the same.
"""

import dataclasses

import numpy as np

from .adopt import amplitudes_of
from .catalogue import Candidate, Motion
from .hypothesis import HORIZONS, Hypothesis, Search, freedom
from .runs import Run
from .screen import with_candidates

ENOUGH = 10.0


def _stretched(command: np.ndarray, by: float) -> np.ndarray:
    at = np.arange(len(command)) / by
    return np.stack([np.interp(at, np.arange(len(command)), column) for column in command.T], -1)


MENU = {
    "the same run again": lambda command: command,
    "the same run at twice the voltage or torque": lambda command: 2 * command,
    "the same run at half the voltage or torque": lambda command: command / 2,
    "the same run three times as slow": lambda command: _stretched(command, 3.0),
    "the same run twice as fast": lambda command: np.concatenate([command[::2], command[::2]])[
        : len(command)
    ],
}


def simulated(search: Search, run: Run, vector: np.ndarray, command: np.ndarray) -> Run:
    """A run under another command, its pieces joined into the motion of the model."""
    other = dataclasses.replace(
        run, command=command, starts=np.tile(run.starts[0], (run.pieces, 1)), valid=np.zeros_like(run.valid)
    )
    problem = search.problem
    for _ in range(4):
        linear = problem.linearise(other, vector, [])
        problem.move_starts(problem.condense(other, linear, other.pieces), np.zeros(0))
    return dataclasses.replace(other, valid=run.valid)


def separations(search: Search, final: Hypothesis, first: Candidate, second: Candidate) -> dict[str, float]:
    """D of `first` from `second` for every experiment of the menu."""
    vector = final.fit.vector
    run = search.runs[0]
    rest = tuple(effect for effect in final.effects if effect.key not in (first.key, second.key))
    free = freedom(search.parameters, rest)
    size = np.array(amplitudes_of(search.parameters, vector, first))
    found = {}
    for name, change in MENU.items():
        other = simulated(search, run, vector, change(run.command))
        linear, (own, rival) = with_candidates(
            search.problem,
            other,
            Motion(search.problem, other, vector),
            vector,
            list(free.columns),
            [first, second],
        )
        matrix = search.problem.condense(other, linear, HORIZONS[-1]).matrix
        if not np.isfinite(matrix).all():
            continue
        columns = [*range(len(free.columns)), *range(rival.start, rival.stop)]
        inner = matrix[np.ix_(columns, columns)] + np.diag(
            [*free.prior(vector)[2], *np.zeros(rival.stop - rival.start)]
        )
        cross = matrix[np.ix_(columns, range(own.start, own.stop))]
        schur = matrix[own, own] - cross.T @ np.linalg.pinv(inner, hermitian=True) @ cross
        found[name] = 0.5 * float(size @ schur @ size)
    return found


def advice(search: Search, final: Hypothesis, first: Candidate, second: Candidate) -> str:
    """What to measure next to tell two effects apart, with the expected separation."""
    found = separations(search, final, first, second)
    names = f"{first.effect} at {first.location} from {second.effect} at {second.location}"
    if not found:
        return f"No experiment could be simulated that tells {names}."
    best = max(found, key=lambda name: found[name])
    now = found.get("the same run again", 0.0)
    if found[best] < ENOUGH:
        return (
            f"No change of the command tells {names} (separation {now:.2g} now, at most {found[best]:.2g} with "
            f"{best}; 10 is enough): one more instrument is needed, on the link if only the joint is measured."
        )
    return f"To tell {names}: {best} (expected separation {found[best]:.0f}, {now:.2g} in this data; 10 is enough)."
