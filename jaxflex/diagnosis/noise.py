"""The noise floor of a measured channel, without a model.

Motion of an arm dies out towards high frequency, noise does not: the level of white noise is
read off the top of the spectrum. Rounding to counts adds its own error, which near rest is not
white and hides from the spectrum; it is known from the size of a count. Noise with colour
cannot be told from motion, except where the arm is known to be at rest: before its input first
moves.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..files.recording import Recording

TOP = 0.4
"""Share of the Nyquist frequency above which a channel is taken to hold noise alone."""

SEGMENT = 256
"""Samples of one short-time spectrum."""

REST = 50
"""Samples of rest below which nothing is said about colour."""

ORDER = 4
"""Highest order of a noise model."""

_AT_REST = 0.001
"""An input at rest stays this close to its first value, as a share of its range, or within its noise."""


@dataclass(frozen=True)
class NoiseFloor:
    """Error of a channel, `e[k] = ar[0] e[k-1] + ar[1] e[k-2] + … + white`.

    **Fields**: `std` standard deviation of e [unit of the channel]; `ar`, empty for white noise
    or where no rest shows its colour; `resolution` [unit] of one count, 0 where there is none;
    `basis`: what `std` rests on.
    """

    std: float
    ar: tuple[float, ...]
    resolution: float
    basis: Literal["spectrum", "spectrum and rest", "resolution"]

    @property
    def innovation(self) -> float:
        """Standard deviation of the white part [unit of the channel]."""
        return self.std / math.sqrt(_variance(self.ar))


def noise_floor(*pieces: np.ndarray, rest: Sequence[np.ndarray] = ()) -> NoiseFloor:
    """Noise floor of a channel from uniformly sampled `pieces`, and the parts of them at `rest`.

    The level is the median of all short-time periodogram ordinates above `TOP` of the Nyquist
    frequency: lines such as mains hum and single shocks do not move it. Rest of at least `REST`
    samples gives the colour, an auto-regressive model of the order that BIC prefers; the level
    still comes from the spectrum.

    Of 10 s at 500 Hz, ringing up to 0.3 of the Nyquist frequency included, the standard deviation
    of white noise is found to 4 %, of noise with `ar = (0.7,)` to 25 % with 100 samples of rest
    and to 12 % with 500.

    Motion in the top of the spectrum counts as noise: think of a current that follows a noisy
    voltage. Coloured noise without rest data is taken for white, at its level in the top, which
    for noise of low frequency is too small.

    **Raises** `ValueError` if no piece holds 32 samples.
    """
    values = np.concatenate(pieces)
    resolution = resolution_of(values)
    rounding = resolution / math.sqrt(12)
    known = [part for part in rest if len(part) >= REST]
    ar = _colour(known, resolution)
    level = _top_of_spectrum(pieces, ar)
    if level < rounding:
        return NoiseFloor(rounding, (), resolution, "resolution")
    return NoiseFloor(level, ar, resolution, "spectrum and rest" if known else "spectrum")


def noise_floors(
    recordings: Sequence[Recording], inputs: Sequence[str], outputs: Sequence[str]
) -> Mapping[str, NoiseFloor]:
    """Noise floor of each of `outputs`, over all `recordings` that hold it.

    Each recording is uniform; the time before the first of its `inputs` moves is its rest.
    """
    rests = [rest_before_motion(recording, inputs) for recording in recordings]
    floors = {}
    for name in outputs:
        holding = [(r[name], n) for r, n in zip(recordings, rests, strict=True) if name in r.channels]
        if holding:
            floors[name] = noise_floor(
                *(values for values, _ in holding), rest=[values[:n] for values, n in holding]
            )
    return floors


def rest_before_motion(recording: Recording, inputs: Sequence[str]) -> int:
    """Number of samples before any of `inputs` moves; 0 if all are constant.

    An arm let go under a constant input is not at rest: without a move of the input nothing is
    known of rest. An arm that still rings before its input moves is not at rest either, and is
    not told from one that is.
    """
    moves = []
    for name in inputs:
        values = recording[name]
        away = np.abs(values - values[0])
        if away.max() > 0:
            # second differences of white noise have six times its variance
            noise = float(np.median(np.abs(np.diff(values[:REST], 2)))) / 0.6745 / math.sqrt(6)
            # an input that chatters from the first sample on is not noise about rest
            moved = away > max(_AT_REST * away.max(), min(5 * noise, away.max() / 2))
            moves.append(int(np.argmax(moved)) if moved.any() else len(values))
    return min(moves, default=0)


def resolution_of(values: np.ndarray) -> float:
    """Size of one count, if `values` lie on a lattice; otherwise 0.

    The smallest difference between two values that occur gives the size roughly, all
    neighbours a few counts apart give it precisely.
    """
    gaps = np.diff(np.unique(values))
    if len(gaps) == 0:
        return 0.0
    near = gaps[gaps < 20 * gaps.min()]
    counts = np.round(near / gaps.min())
    size = float(near @ counts / (counts @ counts))
    misfit = near / size - np.round(near / size)
    on_lattice = len(near) >= min(10, len(gaps) / 2) and np.sqrt(np.mean(misfit**2)) < 0.1
    return size if on_lattice else 0.0


def _top_of_spectrum(pieces: Sequence[np.ndarray], ar: tuple[float, ...]) -> float:
    """Standard deviation of noise of colour `ar` that has the level of the top of the spectrum."""
    ordinates = []
    for piece in pieces:
        second = np.diff(piece, 2)  # so that what motion there is leaks less into the top
        length = min(SEGMENT, len(second))
        if length < 30:
            continue
        window = _blackman_harris(length)
        frames = np.lib.stride_tricks.sliding_window_view(second, length)[:: max(1, length // 4)]
        power = np.abs(np.fft.rfft(frames * window)) ** 2 / np.sum(window**2)
        omega = 2 * np.pi * np.arange(power.shape[1]) / length
        power = power / (2 * np.sin(np.maximum(omega, 1e-9) / 2)) ** 4 / _shape(ar, omega)
        inside = (omega > TOP * np.pi) & (omega < np.pi * (1 - 4 / length))
        ordinates.append(power[:, inside].ravel())
    if not ordinates:
        raise ValueError(f"noise floor: found at most {max(map(len, pieces))} samples; 32 are needed.")
    # an ordinate is exponentially distributed: its median is ln 2 of its mean
    return math.sqrt(float(np.median(np.concatenate(ordinates))) / math.log(2))


def _blackman_harris(length: int) -> np.ndarray:
    """Window with side lobes 92 dB down (Harris 1978)."""
    angle = 2 * np.pi * np.arange(length) / length
    return 0.35875 - 0.48829 * np.cos(angle) + 0.14128 * np.cos(2 * angle) - 0.01168 * np.cos(3 * angle)


def _colour(rest: Sequence[np.ndarray], resolution: float) -> tuple[float, ...]:
    """Auto-regressive model of the noise at rest, by Yule-Walker; the order by BIC, empty for white.

    An arm that a constant force has begun to move, or an instrument that drifts, is not noise with colour:
    BIC says too whether each part has a course of the second degree.
    """
    count = sum(len(part) for part in rest)
    best, chosen = np.inf, ()
    for degree in (0, 2):
        parts = [part - _course(part, degree) for part in rest]
        products = [sum(part[lag:] @ part[: len(part) - lag] for part in parts) for lag in range(ORDER + 1)]
        moments = np.array(products) / max(count, 1)
        if moments[0] <= resolution**2 / 12:
            return ()
        for order in range(ORDER + 1):
            matrix = np.array([[moments[abs(i - j)] for j in range(order)] for i in range(order)])
            ar = np.linalg.solve(matrix, moments[1 : order + 1]) if order else np.zeros(0)
            innovation = moments[0] - ar @ moments[1 : order + 1]
            terms = order + degree * len(parts)
            criterion = count * math.log(max(innovation, 1e-300)) + terms * math.log(count)
            if criterion < best:
                best, chosen = criterion, tuple(float(a) for a in ar)
    return chosen


def _course(part: np.ndarray, degree: int) -> np.ndarray:
    """The polynomial of this degree that is nearest to what was measured."""
    time = np.linspace(-1, 1, len(part))
    return np.polyval(np.polyfit(time, part, degree), time)


def _response(ar: tuple[float, ...], omega: np.ndarray) -> np.ndarray:
    """Spectrum of the noise model at `omega` [rad/sample] for innovations of variance 1."""
    lags = np.arange(1, len(ar) + 1)
    return 1 / np.abs(1 - np.exp(-1j * np.outer(omega, lags)) @ np.asarray(ar)) ** 2


def _variance(ar: tuple[float, ...]) -> float:
    """Variance of the noise model for innovations of variance 1."""
    if not ar:
        return 1.0
    return float(np.mean(_response(ar, 2 * np.pi * np.arange(4096) / 4096)))


def _shape(ar: tuple[float, ...], omega: np.ndarray) -> np.ndarray:
    """Spectrum of the noise model at `omega` [rad/sample], scaled to variance 1."""
    return _response(ar, omega) / _variance(ar) if ar else np.ones_like(omega)
