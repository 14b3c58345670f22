"""The stretches of a recording that tell how the arm rings: free decays, or all of a driven run."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..files.checks import dead
from ..files.recording import Recording, RecordingError

OUTPUTS = ("strain", "tip_deflection", "tip_acceleration")
INPUTS = ("reference", "voltage", "torque", "current")
STILL = 0.01  # share of its range within which an input counts as constant
CYCLES = 4.0  # of the strongest peak that a decay has to last
LEAST = 40  # samples of the shortest stretch


@dataclass(frozen=True)
class Stretch:
    """A piece of a run at equal steps: `outputs` `(channels, times)`, and what drives it, if anything.

    `inputs` `(inputs, times)`; empty for a free decay. `origin` names it in messages.
    """

    step: float
    outputs: np.ndarray
    inputs: np.ndarray
    channels: tuple[str, ...]
    origin: str

    @property
    def times(self) -> np.ndarray:
        """Time from its beginning [s]."""
        return self.step * np.arange(self.outputs.shape[1])


def live(recording: Recording, kinds: tuple[str, ...]) -> list[str]:
    """The channels of these kinds that change."""
    names = [name for name in recording.channels if name.rpartition("_")[0] in kinds]
    return [name for name in names if not dead(recording[name])]


def stretches(recording: Recording) -> list[Stretch]:
    """Free decays, where the inputs stand still long enough; else each piece as driven.

    The reference counts as the input where it is recorded: what a shaper has to cancel
    are the modes that the reference excites. A run without inputs is one decay, from its
    largest excursion on.

    **Raises** `RecordingError` if no channel shows the vibration, or nothing is long enough.
    """
    names = live(recording, OUTPUTS)
    if not names:
        found = ", ".join(recording.channels) or "none"
        wanted = ", ".join(f"{kind}_1" for kind in OUTPUTS)
        raise RecordingError(
            f"{recording.source}: no channel that shows vibration (found {found}); one of {wanted} "
            "that is not constant is needed."
        )
    kinds = [kind for kind in INPUTS if live(recording, (kind,))]
    drives = live(recording, (kinds[0],)) if kinds else []
    found = []
    for piece in recording.split_at_gaps():
        if len(piece) < LEAST:
            continue
        even = piece.to_uniform()
        outputs = np.stack([even[name] for name in names])
        inputs = np.stack([even[name] for name in drives]) if drives else np.zeros((0, len(even)))
        found += _of_piece(even.sample_time, outputs, inputs, tuple(names), recording.source)
    if not found:
        raise RecordingError(
            f"{recording.source}: found {len(recording)} samples; at least {LEAST} in a row are needed."
        )
    return found


def _of_piece(
    step: float, outputs: np.ndarray, inputs: np.ndarray, names: tuple[str, ...], source: str
) -> list[Stretch]:
    def cut(start: int, stop: int, driven: bool) -> Stretch:
        drive = inputs[:, start:stop] if driven else inputs[:0, start:stop]
        return Stretch(step, outputs[:, start:stop], drive, names, source)

    count = outputs.shape[1]
    if not len(inputs):
        away = np.abs(outputs - np.median(outputs[:, -count // 4 :], axis=1, keepdims=True))
        start = int(np.argmax(np.max(away / np.maximum(away.max(axis=1, keepdims=True), 1e-300), axis=0)))
        return [cut(start, count, False)] if count - start >= LEAST else []
    span = STILL * np.ptp(inputs, axis=1, keepdims=True)
    least = max(LEAST, round(CYCLES / (strongest(outputs, step) * step)))
    moving = np.any(np.abs(np.diff(inputs, axis=1)) > span, axis=0)
    edges = [0, *(np.flatnonzero(moving) + 1).tolist(), count]
    decays = []
    for start, stop in pairwise(edges):
        # slow changes are no jumps, but move the input all the same
        quiet = np.all(np.ptp(inputs[:, start:stop], axis=1) <= 2 * span[:, 0]) if stop > start else False
        if stop - start >= least and quiet and _rings(outputs, start, stop):
            decays.append(cut(start, stop, False))
    return decays or [cut(0, count, True)]


def _rings(outputs: np.ndarray, start: int, stop: int) -> bool:
    """True if something is left to decay: it begins at a tenth or more of all that is seen."""
    part = outputs[:, start:stop] - outputs[:, start:stop].mean(axis=1, keepdims=True)
    early = part[:, : max((stop - start) // 3, 1)]
    return bool(np.any(np.ptp(early, axis=1) >= 0.1 * np.ptp(outputs, axis=1)))


def strongest(outputs: np.ndarray, step: float) -> float:
    """Frequency [Hz] of the highest peak of the spectrum of all channels."""
    frequencies, density = spectrum_of(outputs, step)
    return float(frequencies[1 + np.argmax(density[1:])])


def spectrum_of(outputs: np.ndarray, step: float, falling: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies [Hz] and the mean power of all channels there, each channel in units of its deviation.

    Through a Hann window, or the falling half of one, which keeps the beginning of a decay.
    """
    centred = outputs - outputs.mean(axis=1, keepdims=True)
    scaled = centred / np.maximum(centred.std(axis=1, keepdims=True), 1e-300)
    count = outputs.shape[1]
    window = np.hanning(2 * count)[count:] if falling else np.hanning(count)
    length = 1 << (8 * count - 1).bit_length()  # padded, so that peaks are not between the bins
    power = np.abs(np.fft.rfft(scaled * window, length, axis=1)) ** 2
    return np.fft.rfftfreq(length, step), power.mean(axis=0)
