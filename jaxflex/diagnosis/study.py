"""Recordings seen through one arm: the problem they pose, the search for what is missing, what it came to."""

from collections.abc import Callable, Sequence

import numpy as np

from ..files.arm_file import ArmFile
from ..files.recording import Recording
from .calibrate import fit
from .foretell import Foretold, foretell
from .hypothesis import CLOSE, HORIZONS, Hypothesis, Search, freedom
from .outcome import Outcome
from .prepare import HeldOut, make_problem
from .runs import restart

Say = Callable[[str], None]


class Study:
    """An arm and the recordings prepared for it; `outcome` is what a search found.

    `held_out`: what the search does not see, and is judged by; `carried` as for `make_problem`.
    """

    outcome: Outcome

    def __init__(
        self,
        file: ArmFile,
        recordings: Sequence[Recording],
        held_out: HeldOut,
        say: Say,
        carried: bool = False,
    ):
        self.file = file
        self.held_out = held_out
        self.prepared = make_problem(file, recordings, held_out, carried)
        self.search = Search(self.prepared.problem, self.prepared.calibration, say)
        self.notes = self.prepared.notes
        self._foretold: list[tuple[Hypothesis, Foretold]] = []  # the last two that were asked for
        self._everything: tuple[Hypothesis, Hypothesis] | None = None

    def level_of_some(self, horizon: int = HORIZONS[0]) -> float:
        """Misfit a reading over `horizon` of the few pieces that other arms are first tried on."""
        self.search.restart(self.outcome.final_starts)
        return self.search.thinned(horizon).settle(self.outcome.final.fit.vector, horizon).level

    def foretold(self) -> Foretold:
        """The held-out runs, as what was found in the end predicts them."""
        return self.foretold_by(self.outcome.final)

    def foretold_by(self, hypothesis: Hypothesis) -> Foretold:
        """The held-out runs, as a hypothesis predicts them."""
        for known, found in self._foretold:
            if known is hypothesis:
                return found
        found = foretell(self.prepared.problem, self.prepared.held_out, hypothesis)
        self._foretold = [*self._foretold[-1:], (hypothesis, found)]
        return found

    def everything(self) -> Hypothesis:
        """The final hypothesis fitted to all runs, held-out ones too, for the best parameters."""
        final = self.outcome.final
        if self._everything is None or self._everything[0] is not final:
            self._everything = final, self._fitted_to_all(final)
        return self._everything[1]

    def _fitted_to_all(self, final: Hypothesis) -> Hypothesis:
        if any(effect.effect == "periodic_disturbance" for effect in final.effects):
            return final  # its phase is its own in every run
        # the longest horizon over which the model still follows: beyond it, parameters would
        # be bent to make up for what it does not know
        followed = [h for h, cost in final.costs.items() if cost < CLOSE * final.fit.count]
        horizon = max(followed, default=HORIZONS[0])
        prepared, search = self.prepared, self.search
        runs = [*prepared.calibration, *prepared.held_out]
        search.restart(self.outcome.final_starts)
        restart(prepared.held_out, self.foretold().starts)
        free = freedom(search.parameters, final.effects)
        found = fit(prepared.problem, runs, final.fit.vector, free, horizon, 3, fresh=True)
        if not found.level < max(CLOSE, 2 * final.fit.level) or not np.isfinite(found.normal.matrix).all():
            return final  # a run held out cannot be followed
        return Hypothesis(final.effects, found, horizon, {horizon: found.cost})
