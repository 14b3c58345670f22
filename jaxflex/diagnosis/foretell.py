"""What a hypothesis foretells of runs that nothing was fitted to."""

# arrays of numpy go to JAX and come back, which its annotations do not foresee
# pyright: reportArgumentType=false

from typing import NamedTuple

import numpy as np

from .calibrate import Freedom, fit
from .chains import whitened
from .flanks import choose_flanks
from .further import fit_further
from .hypothesis import HORIZONS, Hypothesis
from .runs import Run, Starts, starts_of
from .shooting import Problem

LOST = 3.0  # times the misfit over a shorter horizon: a load in a play cannot be followed for so long
AT_FLOOR = 2.0  # misfit a reading, in units of the noise, up to which nothing is left


class Foretold(NamedTuple):
    """What held-out runs were foretold as.

    `errors` by channel, root mean square; `misfits` a reading by channel, whitened and in units of the
    noise, so that 1 is the noise floor; every run with its readings as predicted; `starts` as fitted;
    `span` [s] over which all are predicted.
    """

    errors: dict[str, float]
    misfits: dict[str, float]
    predictions: list[tuple[Run, np.ndarray]]
    starts: Starts
    span: float

    @property
    def level(self) -> float:
        """Misfit a reading over all channels."""
        return float(np.mean(list(self.misfits.values())))


def foretell(problem: Problem, runs: list[Run], hypothesis: Hypothesis) -> Foretold:
    """Held-out runs as the hypothesis predicts them, the starts of their pieces alone fitted.

    Over a second, or for as long as a load that comes apart from its motor can be followed.
    """
    setting = problem.setting
    # the phase of a disturbance is its own in every run
    free = [
        setting.parameters.position(*effect.key, name)
        for effect in hypothesis.effects
        if effect.effect == "periodic_disturbance"
        for name in effect.amplitudes
    ]
    held = Freedom.full(free)
    plays = [effect.index for effect in hypothesis.effects if effect.effect == "backlash"]
    squares, misfits, predictions, span = [], [], [], HORIZONS[-1]
    for run in runs:
        found = fit(problem, [run], hypothesis.fit.vector, held, HORIZONS[0], 4)
        for joint in plays:
            choose_flanks(problem, [run], found.vector, joint)
        reached = HORIZONS[0]
        for horizon in HORIZONS[1:]:
            limit = LOST * found.level if plays else None
            longer = fit_further(problem, [run], found.vector, held, horizon, limit)
            if longer is None:
                break
            found, reached = longer, horizon
        vector, span = found.vector, min(span, reached)
        reading = problem.predict(run, vector).reading
        lost = ~np.isfinite(reading).all((1, 2), keepdims=True)
        # a motion that cannot be followed counts as if nothing had been foretold of it
        reading = np.where(lost, np.mean(run.reading, (0, 1)), reading)
        error = np.where(run.valid[..., None], run.reading - reading, 0.0)
        squares.append((error**2).sum((0, 1)) / run.valid.sum())
        white = whitened(error.reshape(1, -1, error.shape[-1]).copy(), setting.colour) / setting.noise
        misfits.append((white**2).sum((0, 1)) / run.valid.sum())
        predictions.append((run, reading))

    def by_channel(values: np.ndarray) -> dict[str, float]:
        return dict(zip(setting.channels, map(float, values), strict=True))

    errors, levels = by_channel(np.sqrt(np.mean(squares, 0))), by_channel(np.mean(misfits, 0))
    piece = setting.length * setting.sample_time
    return Foretold(errors, levels, predictions, starts_of(runs), span * piece)
