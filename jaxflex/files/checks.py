"""What looks wrong with a recording, found without a model."""

import numpy as np

from ..sensors import UNITS, unit
from .recording import GAP, Recording

_COMMANDS = ("voltage", "torque", "reference")
"""Channels that a controller may hold still: standing still is no fault of theirs."""

_LARGEST = {
    "angle": (4 * np.pi, "[deg]"),
    "reference": (4 * np.pi, "[deg]"),
    "tip_deflection": (1.0, "[mm]"),
    "strain": (0.01, "[ustrain]"),
    "voltage": (1e3, "[mV]"),
    "current": (1e3, "[mA]"),
}
"""The range, in SI, that a channel of a light arm stays within, and what a larger one may be in."""

_RATIOS = {
    180 / np.pi: "the angle looks like [deg]",
    np.pi / 180: "the rate looks like [deg/s]",
    2 * np.pi / 60: "the rate looks like [rpm]",
    -1.0: "one of the two has the opposite sign",
}
"""What the slope of an angle over its rate says when it is not 1."""

_SLOWEST = 0.05
"""Sample time [s] above which the vibration of a light arm is not seen."""

_STILL = 20
"""Samples for which a moving sensor has to show the same value to count as stuck."""

_CLIPPED = 5
"""Samples for which it has to, at its largest or smallest value, to count as saturated."""


def kind(channel: str) -> str:
    """`angle` of `angle_1`; `tip_x` of `tip_x`."""
    return channel if channel in UNITS else channel.rpartition("_")[0]


def findings(recording: Recording) -> list[str]:
    """One sentence for each thing that looks wrong; the recording stays as it is.

    Jumps of time, unequal steps, a sample time too long; a channel that is constant, stuck,
    saturated or updated only now and then; ranges that suggest another unit; a rate that is
    not the slope of its angle.
    """
    found = _time_findings(recording)
    for name, values in recording.channels.items():
        found += _channel_findings(name, values, recording.times)
    return found + _rate_findings(recording)


def dead(values: np.ndarray) -> bool:
    """True if a channel shows one value throughout."""
    return bool(np.all(values == values[0]))


def standstills(values: np.ndarray) -> tuple[list[slice], int]:
    """Where a sensor freezes while in motion, and the samples from one update to the next.

    A sensor that comes to rest and leaves it does so by small steps; one that is clipped, stuck
    or unplugged stands still right after, or right before, a step of more than three times its
    resolution. A sensor slower than the recording does so at every update, which is told by its
    usual time between updates.
    """
    last = np.flatnonzero(np.diff(values))  # the last sample of each stretch but the final one
    if len(last) < _STILL:
        return [], 1
    steps = np.abs(values[last + 1] - values[last])
    large = steps > 3 * steps.min()
    starts, stops = last + 1, np.append(last[1:] + 1, len(values))
    update = int(np.median((stops - starts)[large])) if np.count_nonzero(large) >= _STILL else 1
    at_end = (values[starts] == values.max()) | (values[starts] == values.min())
    least = np.where(at_end, _CLIPPED, _STILL) * update
    frozen = (large | np.append(large[1:], False)) & (stops - starts > least)
    return [slice(int(a), int(b)) for a, b in zip(starts[frozen], stops[frozen], strict=True)], update


def _time_findings(recording: Recording) -> list[str]:
    found = []
    times, sample_time = recording.times, recording.sample_time
    gaps = recording.gaps()
    if len(gaps):
        i = gaps[0]
        found.append(
            f"time jumps {len(gaps)} time(s) by more than {GAP:g} samples, first from {times[i]:.6g} s "
            f"to {times[i + 1]:.6g} s; the pieces between are used one by one"
        )
    pieces = recording.split_at_gaps()
    if not all(piece.uniform for piece in pieces):
        steps = np.concatenate([np.diff(piece.times) for piece in pieces])
        found.append(
            f"steps of time vary from {steps.min():.6g} s to {steps.max():.6g} s; kept, "
            f"with a sample time of {sample_time:.6g} s"
        )
    if sample_time > _SLOWEST:
        found.append(f"sample time {sample_time:.4g} s is slow for a flexible arm; is time in [ms]?")
    return found


def _channel_findings(name: str, values: np.ndarray, times: np.ndarray) -> list[str]:
    base = kind(name)
    if dead(values):
        if base in _COMMANDS:
            return []
        return [f"{name}: {values[0]:.6g} [{unit(name)}] throughout: a dead sensor, or nothing moved"]
    found = []
    if base in _LARGEST:
        largest, other = _LARGEST[base]
        span = float(np.ptp(values))
        if span > largest:
            found.append(
                f"{name}: ranges over {span:.4g} [{unit(name)}], more than {largest:.4g}; "
                f"if it is in {other}, the header must say so"
            )
    if base not in _COMMANDS:
        found += _standstill_findings(name, values, times)
    return found


def _standstill_findings(name: str, values: np.ndarray, times: np.ndarray) -> list[str]:
    frozen, update = standstills(values)
    found = []
    if update > 1:
        found.append(f"{name}: updated only every {update} samples; held in between")
    ends = (values.min(), values.max())
    for word, at_end in (("saturated", True), ("stuck", False)):
        places = [place for place in frozen if (values[place.start] in ends) == at_end]
        if places:
            count = sum(place.stop - place.start for place in places)
            found.append(
                f"{name}: {word} at {values[places[0].start]:.6g} [{unit(name)}] for {count} samples "
                f"in {len(places)} place(s), first at {times[places[0].start]:.6g} s"
            )
    return found


def _rate_findings(recording: Recording) -> list[str]:
    """Compare each rate with the slope of its angle, over stretches long enough to bury the counts."""
    found = []
    for name, rate in recording.channels.items():
        angle = f"angle_{name.rpartition('_')[2]}"
        if kind(name) != "rate" or angle not in recording.channels:
            continue
        stride = max(1, len(recording) // 200)
        turned = np.diff(recording[angle][::stride])
        travelled = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2 * np.diff(recording.times))])
        expected = np.diff(travelled[::stride])
        size = np.linalg.norm(turned) * np.linalg.norm(expected)
        if size == 0 or abs(turned @ expected) < 0.9 * size:
            continue
        slope = float(turned @ expected / (expected @ expected))
        for ratio, meaning in _RATIOS.items():
            if abs(slope / ratio - 1) < 0.2:
                found.append(f"{name}: the slope of {angle} is {slope:.3g} times it; {meaning}")
    return found
