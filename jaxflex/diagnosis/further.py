"""A fit gone on with over a longer horizon."""

import numpy as np

from .calibrate import MOST, Fit, Freedom, fit, settle
from .flanks import join_pieces
from .runs import Run, restart, starts_of
from .shooting import Problem


def fit_further(
    problem: Problem,
    runs: list[Run],
    vector: np.ndarray,
    freedom: Freedom,
    horizon: int,
    limit: float | None = None,
    iterations: int = 4,
    most: int = MOST,
) -> Fit | None:
    """The fit over `horizon` pieces, joined, from where one over fewer of them ended; the rest as for `fit`.

    None, the starts as they were, where it leaves no less than `limit` a reading: the motion cannot be
    followed for so long.
    """
    starts = starts_of(runs)
    join_pieces(problem, runs, vector, horizon)
    if problem.setting.parameters.plays and freedom.columns:
        # where a contact opens and shuts, only slopes near it hold
        settle(problem, runs, vector, horizon)
    found = fit(problem, runs, vector, freedom, horizon, iterations, most=most)
    if limit is not None and not found.level < limit:
        restart(runs, starts)
        return None
    return found
