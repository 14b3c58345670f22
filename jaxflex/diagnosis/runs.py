"""A recording cut into pieces, and what is known of it where it stands."""

# arrays of numpy go to JAX and come back, which its annotations do not foresee
# pyright: reportArgumentType=false, reportOptionalMemberAccess=false

from dataclasses import dataclass

import numpy as np

from .plant import Pieces, Response
from .steps import Here, Point


@dataclass(frozen=True)
class Shown(Here):
    """What a run shows there, the pieces that do, and the slope of their commands with delay."""

    response: Response
    pieces: Pieces
    delay_slope: np.ndarray


@dataclass(frozen=True)
class Slopes:
    """Slopes of every piece, in units of the noise, where they were last taken."""

    by_start: np.ndarray  # (pieces, samples, channels, states)
    end_by_start: np.ndarray  # (pieces, states, states)
    by_column: dict[int, tuple[np.ndarray, np.ndarray]]  # readings (pieces, samples, channels), ends


@dataclass
class Run:
    """A recording cut into pieces, those at `places` of which count, with the states that these start from.

    `measured`: those states as the readings alone tell them, before anything was fitted.
    """

    times: np.ndarray  # (samples,)
    command: np.ndarray  # (samples, joints), as logged
    reading: np.ndarray  # (pieces, samples, channels)
    valid: np.ndarray  # (pieces, samples)
    starts: np.ndarray  # (pieces, states)
    measured: np.ndarray
    places: np.ndarray
    slopes: Slopes | None = None
    point: Point | None = None
    shown: Shown | None = None

    @property
    def pieces(self) -> int:
        """Number of pieces."""
        return self.reading.shape[0]

    @property
    def follows(self) -> np.ndarray:
        """True of the pieces that begin where the one before ends."""
        return np.diff(self.places, prepend=-2) == 1

    def thinned(self, stride: int, together: int = 1) -> "Run":
        """Of every `stride` times `together` pieces the first ones, enough for fits over `together` of them."""
        groups = self.places[: self.pieces // together * together].reshape(-1, together)[::stride]
        places = groups.ravel() if groups.size else self.places
        return self.only(np.searchsorted(self.places, places))

    def only(self, at: np.ndarray) -> "Run":
        """These of the pieces, one as often as it is asked for."""
        parts = (part[at] for part in (self.reading, self.valid, self.starts, self.measured, self.places))
        return Run(self.times, self.command, *parts)


Starts = list[tuple[np.ndarray, Slopes | None]]


def starts_of(runs: list[Run]) -> Starts:
    """The starts of all pieces of these runs, with the slopes there."""
    return [(run.starts.copy(), run.slopes) for run in runs]


def restart(runs: list[Run], starts: Starts) -> None:
    """Back to what `starts_of` gave."""
    for run, (kept, slopes) in zip(runs, starts, strict=True):
        run.starts, run.slopes = kept.copy(), slopes
