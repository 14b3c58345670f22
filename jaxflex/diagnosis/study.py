"""Recordings seen through one arm: the problem they pose, the search for what is missing, what it came to."""

from collections.abc import Callable, Sequence

from ..files.arm_file import ArmFile
from ..files.recording import Recording
from .foretell import Foretold, foretell
from .hypothesis import Hypothesis, Outcome, Search
from .prepare import make_problem

Say = Callable[[str], None]


class Study:
    """An arm and the recordings prepared for it; `outcome` is what a search found.

    `divided`: the end of every recording is held out, and not the later ones of them.
    """

    outcome: Outcome

    def __init__(self, file: ArmFile, recordings: Sequence[Recording], divided: bool, say: Say):
        self.file = file
        self.prepared = make_problem(file, recordings, divided)
        self.search = Search(self.prepared.problem, self.prepared.calibration, say)
        self.notes = self.prepared.notes
        self._foretold: tuple[Hypothesis, Foretold] | None = None

    def foretold(self) -> Foretold:
        """The held-out runs, as what was found in the end predicts them."""
        final = self.outcome.final
        if self._foretold is None or self._foretold[0] is not final:
            self._foretold = final, foretell(self.prepared.problem, self.prepared.held_out, final)
        return self._foretold[1]
