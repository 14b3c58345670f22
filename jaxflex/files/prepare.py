"""A recording made ready to be compared with a simulation."""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from .checks import dead
from .recording import Recording, RecordingError

SHORTEST = 100
"""Samples below which a piece of a recording is not used."""

LONGEST = 20_000
"""Samples above which the busiest part of a recording is used in place of all of it."""


def require_channels(
    recording: Recording, inputs: Sequence[str], outputs: Sequence[str], samples: int = SHORTEST
) -> tuple[str, ...]:
    """Which of `outputs` the recording holds, those that show one value throughout left out.

    **Raises** `RecordingError` unless every one of `inputs` and at least one of `outputs` is
    there, in at least `samples` rows.
    """
    source, found = recording.source, ", ".join(recording.channels) or "none"
    if len(recording) < samples:
        raise RecordingError(f"{source}: found {len(recording)} samples; at least {samples} are needed.")
    for name in inputs:
        if name not in recording.channels:
            raise RecordingError(f"{source}: {name}: missing, found {found}; it drives the model.")
    there = [name for name in outputs if name in recording.channels]
    live = tuple(name for name in there if not dead(recording[name]))
    if not live:
        faults = "; ".join(f"{name} is constant" for name in there) or f"found {found}"
        raise RecordingError(f"{source}: {faults}; at least one of {', '.join(outputs)} is needed.")
    return live


def prepare(
    recording: Recording,
    inputs: Sequence[str],
    outputs: Sequence[str],
    sample_time: float | None = None,
    samples: int = LONGEST,
    held: Collection[str] | None = None,
) -> list[Recording]:
    """Pieces of the recording without gaps, at equal steps, of `inputs` and live `outputs` only.

    `sample_time` [s] is the wanted one (default: the recording's); `held` as in
    `Recording.to_uniform`. Of a longer recording the busiest `samples` are kept. What is left
    out is said in `repairs` of each piece.

    **Raises** `RecordingError` as `require_channels` does, or if no piece is long enough.
    """
    live = require_channels(recording, inputs, outputs)
    kept = replace(recording, channels={name: recording[name] for name in (*inputs, *live)})
    notes = [
        f"{name}: constant; not compared" for name in outputs if name in recording.channels.keys() - live
    ]
    step = recording.sample_time if sample_time is None else sample_time
    pieces = kept.split_at_gaps()
    long = [piece for piece in pieces if piece.times[-1] - piece.times[0] >= (SHORTEST - 1.5) * step]
    if not long:
        longest = max(piece.times[-1] - piece.times[0] for piece in pieces)
        raise RecordingError(
            f"{recording.source}: the longest piece without a gap lasts {longest:.4g} s; "
            f"at least {SHORTEST} samples of {step:.4g} s are needed."
        )
    if len(long) < len(pieces):
        lost = len(recording) - sum(len(piece) for piece in long)
        notes.append(f"{lost} samples in pieces shorter than {SHORTEST} samples were left out")
    even = [piece.noting(*notes).to_uniform(step, held) for piece in long]
    return _longest(even, samples)


def busiest(recording: Recording, samples: int) -> Recording:
    """The `samples` in a row in which the channels vary most, each measured against its own variance."""
    if len(recording) <= samples:
        return recording
    block = samples // 4
    count = len(recording) // block
    activity = np.zeros(count - 3)
    for values in recording.channels.values():
        if not dead(values):
            blocks = ((values[: count * block] - values.mean()) / values.std()).reshape(count, block)
            activity += _over_four(np.mean(blocks**2, axis=1)) - _over_four(np.mean(blocks, axis=1)) ** 2
    start = int(np.argmax(activity)) * block
    times = recording.times
    return recording.window(start, start + samples).noting(
        f"of {len(recording)} samples the {samples} from {times[start]:.6g} s to "
        f"{times[start + samples - 1]:.6g} s are used, where the channels vary most"
    )


def _over_four(values: np.ndarray) -> np.ndarray:
    """Mean of every four in a row."""
    return np.convolve(values, np.full(4, 0.25), mode="valid")


def _longest(pieces: list[Recording], samples: int) -> list[Recording]:
    """The longest pieces, until `samples` are reached, in order of time."""
    kept, left = [], samples
    for piece in sorted(pieces, key=len, reverse=True):
        if left >= SHORTEST:
            kept.append(busiest(piece, left))
            left -= len(kept[-1])
    note = f"the {len(kept)} longest of {len(pieces)} pieces between gaps are used"
    notes = (note,) if len(kept) < len(pieces) else ()
    return [piece.noting(*notes) for piece in sorted(kept, key=lambda piece: piece.times[0])]
