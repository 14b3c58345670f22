"""Which flank of a joint's play a piece of a run begins at.

No reading shows it, and a fit by slopes does not cross the gap: the other flank has to be tried.
"""

import numpy as np

from .hypothesis import restart, settle, starts_of
from .plant import twist_place
from .runs import Run
from .shooting import LOST_PIECE, Problem


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


def _play(problem: Problem, vector: np.ndarray, joint: int) -> tuple[int, float]:
    """The coordinate of what lies between motor and link of a joint that was taken apart, and its gap."""
    parameters = problem.setting.parameters
    return twist_place(parameters.arm.assemble(), joint), float(vector[parameters.plays[joint]])
