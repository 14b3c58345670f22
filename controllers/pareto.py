"""Residual vibration against move time: the best design for each, from one call."""

from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import numpy as np
from jaxtyping import Array, Bool, Float

from jaxflex import scalar

from .move_problem import Problem, standard_start
from .tuning import Tuned, tune


class ParetoFront(NamedTuple):
    """`move_time` [s] ascending, the worst `residual_vibration` [m] of the scenarios there, and what was `tuned`.

    `efficient` marks the points that no shorter move matches.
    """

    move_time: Float[np.ndarray, " points"]
    residual_vibration: Float[np.ndarray, " points"]
    efficient: Bool[np.ndarray, " points"]
    tuned: list[Tuned]


def at_pace(problem: Problem, factor: float) -> Problem:
    """The same problem with command and shaper `factor` times as long."""
    return eqx.tree_at(
        lambda p: (p.move.duration, p.shaper_time),
        problem,
        (scalar(factor) * problem.move.duration, scalar(factor) * problem.shaper_time),
    )


def pareto_front(
    problem: Problem,
    move_times: Float[Array, " points"] | np.ndarray,
    progress: Callable[[int, float], None] | None = None,
    **options,
) -> ParetoFront:
    """The problem tuned for each of `move_times` [s], from the slowest, each from the last one's outcome.

    `options` as for `tune`. One compiled program serves all points.
    `progress(points done, residual vibration [m])` is called on the way.
    """
    slowest_first = np.sort(np.asarray(move_times, float))[::-1]
    values, found = standard_start(problem), []
    for number, move_time in enumerate(slowest_first, 1):
        paced = at_pace(problem, float(move_time / problem.total_time()))
        tuned = tune(paced, values, **options)
        residual = float(np.max((tuned.measures or {})["residual_vibration"]))
        found.append((residual, tuned))
        values = tuned.values
        if progress is not None:
            progress(number, residual)
    vibration = np.array([residual for residual, _ in found])[::-1]
    best_so_far = np.minimum.accumulate(vibration)
    efficient = np.concatenate([[True], vibration[1:] < best_so_far[:-1]])
    return ParetoFront(slowest_first[::-1], vibration, efficient, [tuned for _, tuned in found][::-1])
