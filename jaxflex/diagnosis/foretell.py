"""What a hypothesis foretells of runs that nothing was fitted to."""

# arrays of numpy go to JAX and come back, which its annotations do not foresee
# pyright: reportArgumentType=false

from typing import NamedTuple

import numpy as np

from .calibrate import Freedom, fit
from .flanks import choose_flanks
from .hypothesis import HORIZONS, Hypothesis, Starts, starts_of
from .shooting import LOST_PIECE, Problem, Run

AT_FLOOR = 2.0  # misfit a reading, in units of the noise, up to which nothing is left


class Foretold(NamedTuple):
    """Errors by channel, root mean square; every run with its readings as predicted; misfit a reading.

    The `level` is in units of the noise, so 1 is the noise floor; `starts` are those that were fitted.
    """

    errors: dict[str, float]
    predictions: list[tuple[Run, np.ndarray]]
    level: float
    starts: Starts


def noise(problem: Problem) -> dict[str, float]:
    """Standard deviation of each channel's noise."""
    s = problem.setting
    return {c: float(n) for c, n in zip(s.channels, s.noise, strict=True)}


def foretell(problem: Problem, runs: list[Run], hypothesis: Hypothesis) -> Foretold:
    """Held-out runs as the hypothesis predicts them, the starts of their pieces alone fitted."""
    # the phase of a disturbance is its own in every run
    free = [
        problem.setting.parameters.position(*effect.key, name)
        for effect in hypothesis.effects
        if effect.effect == "periodic_disturbance"
        for name in effect.amplitudes
    ]
    held = Freedom.full(free)
    plays = [effect.index for effect in hypothesis.effects if effect.effect == "backlash"]
    squares, predictions = [], []
    for run in runs:
        vector = hypothesis.fit.vector
        for horizon in HORIZONS:
            if horizon > HORIZONS[0]:
                problem.join(run, vector)
            found = fit(problem, [run], vector, held, horizon, 4)
            vector = found.vector
            for joint in plays if horizon == HORIZONS[0] else ():
                choose_flanks(problem, [run], vector, joint, LOST_PIECE)
        reading = problem.predict(run, vector).reading
        lost = ~np.isfinite(reading).all((1, 2), keepdims=True)
        # a motion that cannot be followed counts as if nothing had been foretold of it
        reading = np.where(lost, np.mean(run.reading, (0, 1)), reading)
        error = np.where(run.valid[..., None], run.reading - reading, 0.0)
        squares.append((error**2).sum((0, 1)) / run.valid.sum())
        predictions.append((run, reading))
    rms = np.sqrt(np.mean(squares, 0))
    errors = dict(zip(problem.setting.channels, map(float, rms), strict=True))
    level = float(np.mean([(errors[c] / s) ** 2 for c, s in noise(problem).items()]))
    return Foretold(errors, predictions, level, starts_of(runs))
