"""Where in a joint's play a piece of a run begins.

No reading shows it, and a fit by slopes does not cross the gap: other places have to be tried.
"""

import dataclasses

import numpy as np

from .calibrate import settle
from .plant import twist_place
from .runs import Run, restart, starts_of
from .shooting import LOST_PIECE, Problem

PLACES = 15  # from flank to flank, where a load may rest


def press(problem: Problem, runs: list[Run], vector: np.ndarray, joint: int) -> None:
    """Start every piece with the flank pressed that the moment of the bent link presses.

    Where nothing bends, a load is where the piece before leaves it.
    """
    if problem.setting.hidden:
        return
    link = problem.setting.parameters.arm.assemble().links[joint]
    twist, gap = _play(problem, vector, joint)
    curvature = np.array([float(c) for c in link.gauge_curvature])
    for run in runs:
        bent = run.starts[:, twist + 1 - link.shapes : twist + 1] @ curvature
        run.starts[:, twist] = np.sign(bent) * gap / 2


def choose_flanks(problem: Problem, runs: list[Run], vector: np.ndarray, joint: int) -> None:
    """Start the pieces that are lost at one flank or the other, where that fits better."""
    twist, gap = _play(problem, vector, joint)

    def misfits() -> list[np.ndarray]:
        return [problem.misfit(run, problem.predict(run, vector)) for run in runs]

    first, before = starts_of(runs), misfits()
    best = [(run.starts, misfit) for run, misfit in zip(runs, before, strict=True)]
    for side in (-gap / 2, gap / 2):
        restart(runs, first)
        for run, misfit in zip(runs, before, strict=True):
            run.starts[misfit > LOST_PIECE, twist] = side
        settle(problem, runs, vector)
        for k, (run, misfit) in enumerate(zip(runs, misfits(), strict=True)):
            better = misfit < best[k][1]
            best[k] = np.where(better[:, None], run.starts, best[k][0]), np.where(better, misfit, best[k][1])
    for run, (starts, _) in zip(runs, best, strict=True):
        run.starts, run.slopes = starts, None


def join_pieces(problem: Problem, runs: list[Run], vector: np.ndarray, horizon: int) -> None:
    """Join the pieces of these runs for a fit over `horizon` of them, loads in a play from where that suits them."""
    for run in runs:
        problem.join(run, vector)
        for joint, gap in problem.setting.parameters.plays.items():
            if vector[gap] > 0:
                _rest(problem, run, vector, joint, horizon)


def _rest(problem: Problem, run: Run, vector: np.ndarray, joint: int, horizon: int) -> None:
    """Begin pieces that follow none, and with those after them are lost, where in the play suits these `horizon`.

    A load at rest between the flanks leaves no trace until one of them meets it; a fit over fewer pieces may have
    bent the rest of a start to make up for that, so that places are tried beside what was measured too.
    """
    twist, gap = _play(problem, vector, joint)
    first = np.flatnonzero(~run.follows)
    number = 1 + 2 * PLACES
    tried = np.repeat(run.starts[first, None], number, axis=1)
    tried[:, 1 + PLACES :] = run.measured[first, None]
    tried[:, 1:, twist] = np.tile(np.linspace(-gap / 2, gap / 2, PLACES), 2)
    at = np.repeat(first, number)
    ways, count, misfit = _carried(problem, run, vector, at, tried.reshape(len(at), -1), horizon)
    misfit = np.where(np.isnan(misfit), np.inf, misfit).reshape(len(first), -1)
    for k, best in enumerate(np.argmin(misfit, axis=1)):
        if misfit[k, 0] > LOST_PIECE * max(1.0, misfit[k, best]):
            way = k * number + best
            pieces = slice(first[k], first[k] + count[way])
            run.starts[pieces], run.slopes = ways[: count[way], way], None


def _carried(
    problem: Problem, run: Run, vector: np.ndarray, at: np.ndarray, starts: np.ndarray, horizon: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pieces `at` from these starts and up to `horizon - 1` after them, each from where the one before ends.

    **Returns** all their starts `(horizon, ways, states)`, how many pieces each way has, and its mean misfit.
    """
    total, count = np.zeros(len(at)), np.zeros(len(at), dtype=int)
    going, ways = np.ones(len(at), dtype=bool), []
    for _ in range(horizon):
        ways.append(starts)
        ends, misfit = np.empty_like(starts), np.empty(len(at))
        for k in range(0, len(at), run.pieces):
            # as many as the run has, for which the motion is compiled
            some = np.arange(k, k + run.pieces) % len(at)
            piece = dataclasses.replace(run.only(at[some]), starts=starts[some])
            response = problem.predict(piece, vector)
            ends[some], misfit[some] = response.end, problem.misfit(piece, response)
        total, count = total + np.where(going, misfit, 0.0), count + going
        after = np.minimum(at + 1, run.pieces - 1)
        going = going & (after > at) & run.follows[after]
        at, starts = np.where(going, after, at), np.where(going[:, None], ends, starts)
    return np.array(ways), count, total / count


def _play(problem: Problem, vector: np.ndarray, joint: int) -> tuple[int, float]:
    """The coordinate of what lies between motor and link of a joint that was taken apart, and its gap."""
    parameters = problem.setting.parameters
    return twist_place(parameters.arm.assemble(), joint), float(vector[parameters.plays[joint]])
