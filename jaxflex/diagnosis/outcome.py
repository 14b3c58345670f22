"""What a search came to, and what there was to explain."""

import dataclasses

import numpy as np

from .catalogue import Candidate
from .hypothesis import HORIZONS, Hypothesis, Ranked
from .runs import Starts


class Outcome:
    """What the search came to: the nominal fit, the final one, and rivals of each effect.

    `level`: misfit a reading over the longest horizon; `nominal_level`: the same without any effect.
    `waiting`: of a search that waits, the final hypothesis as it began, and where its pieces started.
    """

    waiting: tuple[Hypothesis, Starts] | None = None

    def __init__(self, nominal: Hypothesis, starts: Starts, level: float):
        self.nominal = nominal
        self.nominal_starts = starts
        self.nominal_level = level
        self.final = nominal
        self.final_starts = starts
        self.level = level
        self.rivals: list[tuple[int, Hypothesis]] = []
        self.close: dict[tuple[str, str], list[Ranked]] = {}  # what did as well when an effect was added
        self.passed: dict[tuple[Candidate, ...], tuple[Hypothesis, Starts]] = {}  # final ones on the way
        self.gains: list[float] = []

    def drop(self, place: int, final: Hypothesis, starts: Starts) -> None:
        """The effect at this place is no longer part of what was found, which is `final` without it."""
        self.final, self.final_starts = final, starts
        self.gains = [gain for at, gain in enumerate(self.gains) if at != place]
        self.rivals = [(at - (at > place), rival) for at, rival in self.rivals if at != place]

    def put(self, place: int, first: int) -> None:
        """The effect at `place` is told before that at `first`."""
        order = [*range(len(self.final.effects))]
        order.insert(first, order.pop(place))
        self.final = dataclasses.replace(self.final, effects=tuple(self.final.effects[at] for at in order))
        self.gains = [self.gains[at] for at in order]
        self.rivals = [(order.index(at), rival) for at, rival in self.rivals]

    @property
    def explained(self) -> float:
        """Cost over the longest horizon that the effects account for, 0 if the motion was lost there."""
        gone = self.nominal_level - self.level
        return gone * self.final.fit.count if np.isfinite(gone) else 0.0

    def explained_over(self) -> dict[int, float]:
        """Cost that the effects account for over every horizon, at least what they do over the shortest."""
        short = self.nominal.costs[HORIZONS[0]] - self.final.costs[HORIZONS[0]]
        longer = {h: max(short, h / HORIZONS[-1] * self.explained) for h in HORIZONS[1:]}
        return {HORIZONS[0]: short} | longer
