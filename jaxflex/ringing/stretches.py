"""The stretches of a recording that tell how the arm rings: free decays, or all of a driven run."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy  # whose parts, imported when first used, take longer to import than all here

from ..files.checks import dead
from ..files.recording import Recording, RecordingError

OUTPUTS = ("strain", "tip_deflection", "tip_acceleration")
DRIVES = ("voltage", "torque", "current")
INPUTS = ("reference", *DRIVES, "angle")
STILL = 2e-3  # share of its range within which an input counts as constant
LEFT = 0.3  # share of its range that a decay still has where it is taken to begin later
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


def common_inputs(recordings: Sequence[Recording]) -> list[str | None]:
    """Which kinds of channel may count as what drives the arm, the likeliest first; None if nothing recorded does.

    The reference where all have it, for what a shaper has to cancel are the modes that
    the reference excites. Else the drive's command; and, if that explains little (of a joint
    that rubs, say), the joint's own angle, whatever moves it.
    """
    there = [kind for kind in INPUTS if all(live(recording, (kind,)) for recording in recordings)]
    if "reference" in there:
        return ["reference"]
    drive = next((kind for kind in DRIVES if kind in there), None)
    return [drive, "angle"] if "angle" in there else [drive]


def stretches(recording: Recording, driven_by: str | None) -> list[Stretch]:
    """Free decays, where the inputs of this kind stand still long enough; else each piece as driven.

    A run without inputs is one decay, from its largest excursion on.

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
    drives = [] if driven_by is None else live(recording, (driven_by,))
    if driven_by is not None and not drives:
        raise RecordingError(
            f"{recording.source}: no channel {driven_by}_1 that changes; found {', '.join(recording.channels)}."
        )
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


def later(found: list[Stretch], cycles: float) -> list[Stretch]:
    """Free decays from `cycles` of the strongest peak after their beginning on, those with enough left."""
    left = []
    for s in found:
        cycle = 1 / (strongest(s.outputs, s.step) * s.step)
        start = round(cycles * cycle)
        rest = s.outputs[:, start:]
        if rest.shape[1] < max(LEAST, CYCLES * cycle):
            continue
        if np.any(np.ptp(rest, axis=1) >= LEFT * np.ptp(s.outputs, axis=1)):
            left.append(replace(s, outputs=rest, inputs=s.inputs[:, start:]))
    return left


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
    least = min(max(LEAST, round(CYCLES / (strongest(outputs, step) * step))), count)
    decays = [
        cut(start, stop, False) for start, stop in _still(inputs, least) if _rings(outputs, start, stop)
    ]
    return decays or [cut(0, count, True)]


def _still(inputs: np.ndarray, least: int) -> list[tuple[int, int]]:
    """Where no input leaves a band of `STILL` of its range within any `least` samples: first and last + 1."""
    whole = np.ptp(inputs, axis=1, keepdims=True)
    width = scipy.ndimage.maximum_filter1d(inputs, least, axis=1) - scipy.ndimage.minimum_filter1d(
        inputs, least, axis=1
    )
    middles = np.all(width <= STILL * whole, axis=0)
    starts = np.flatnonzero(middles[least // 2 : inputs.shape[1] - least + least // 2 + 1])
    if not len(starts):
        return []
    runs = np.split(starts, np.flatnonzero(np.diff(starts) > 1) + 1)
    return [(int(run[0]), int(run[-1]) + least) for run in runs]


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
