"""First estimates of poles: the eigensystem realisation of decays, and of impulse responses.

A sum of n decaying exponentials fills a Hankel matrix of rank n, whose column space shifts
by a sample under the matrix with the poles as eigenvalues (Juang and Pappa 1985). The
impulse response of a driven run comes from a long autoregressive model of it, as in the
observer identification of Juang, Phan, Horta and Longman (1993).
"""

import numpy as np

from .stretches import Stretch, spectrum_of

FINE = 6.0  # samples per period of the highest peak at which the Hankel matrix is filled
ORDER = 16  # poles, at most
PEAK = 100.0  # times the median of the spectrum that a peak has to reach to count
COLUMNS = 3000
COARSER = (1.0, 3.0, 9.0)  # steps of time, relative to the finest, at which a driven run is looked at
SHARE = 1e-3  # of the highest peak, below which another is not looked at


def first_poles(stretches: list[Stretch]) -> np.ndarray:
    """Candidate poles [rad/s], real ones and one of each pair, in no order."""
    top, low = highest_peak(stretches)
    if len(stretches[0].inputs):
        # a step of time that suits high modes hides low ones in noise, and one that suits low ones has no room
        return np.concatenate([_driven(s, _heard(s) / part) for s in stretches for part in COARSER])
    step = stretches[0].step
    shortest = min(s.outputs.shape[1] for s in stretches)
    stride = max(1, min(int(1 / (FINE * top * step)), shortest // (4 * ORDER)))
    rows = int(np.clip(2.0 / (low * stride * step), 2 * ORDER, 80))
    rows = max(2, min(rows, shortest // (2 * stride)))
    blocks = []
    for stretch in stretches:
        scaled = stretch.outputs / np.maximum(np.std(stretch.outputs, axis=1, keepdims=True), 1e-300)
        last = scaled.shape[1] - 1 - rows * stride
        starts = np.unique(np.linspace(0, last, min(last + 1, COLUMNS)).astype(int))
        blocks.append(np.vstack([scaled[:, starts + r * stride] for r in range(rows + 1)]))
    return _realise(np.hstack(blocks), stretches[0].outputs.shape[0], stride * step)


def highest_peak(stretches: list[Stretch]) -> tuple[float, float]:
    """Frequencies [Hz] of the highest and of the lowest peak that stand out of the noise."""
    tops, lows = [], []
    for stretch in stretches:
        f, density = spectrum_of(stretch.outputs, stretch.step, falling=not len(stretch.inputs))
        inside = np.flatnonzero((density[1:-1] > density[:-2]) & (density[1:-1] >= density[2:])) + 1
        floor = max(PEAK * np.median(density), SHARE * density[1:].max())
        peaks = inside[density[inside] >= floor]
        peaks = peaks if len(peaks) else np.array([1 + np.argmax(density[1:])])
        tops.append(f[peaks].max())
        lows.append(f[peaks].min())
    return float(max(tops)), float(min(lows))


def _heard(stretch: Stretch) -> float:
    """Highest frequency [Hz] at which a driven run is heard over the noise; its peaks may be the input's."""
    f, density = spectrum_of(stretch.outputs, stretch.step)
    cells = 8 * (2 * len(f)) // stretch.outputs.shape[1]  # padding makes neighbours alike
    smooth = np.convolve(density, np.full(cells, 1 / cells), mode="same")
    heard = np.flatnonzero(smooth > 10 * np.median(smooth[len(smooth) // 2 :]))
    return float(f[heard[-1]]) if len(heard) else float(f[1 + np.argmax(density[1:])])


def _realise(hankel: np.ndarray, channels: int, step: float) -> np.ndarray:
    """Poles [rad/s] of the shift of a Hankel matrix, of its rank above the noise."""
    left, sizes, _ = np.linalg.svd(hankel, full_matrices=False)
    noise = 2.5 * np.median(sizes) if len(sizes) > 2 * ORDER else 0.0
    rank = int(np.clip(np.sum(sizes > max(noise, 1e-8 * sizes[0])), 2, ORDER))
    basis = left[:, : min(rank, len(hankel) // 2)]
    shift = np.linalg.lstsq(basis[:-channels], basis[channels:], rcond=None)[0]
    values = np.linalg.eigvals(shift).astype(complex)
    poles = np.log(values[np.abs(values) > 1e-12]) / step
    return poles[np.imag(poles) >= 0]


def _driven(stretch: Stretch, top: float) -> np.ndarray:
    """Poles of a driven stretch, from the impulse response of an autoregressive model with input."""
    stride = max(1, int(1 / (0.5 * FINE * top * stretch.step)))
    count = stretch.outputs.shape[1] // stride * stride

    def coarse(values):
        return values[:, :count].reshape(len(values), -1, stride).mean(axis=2)

    y, u = coarse(stretch.outputs), coarse(stretch.inputs)
    y = (y - y.mean(axis=1, keepdims=True)) / np.maximum(y.std(axis=1, keepdims=True), 1e-300)
    u = u - u[:, :1]
    channels, length = y.shape
    order = int(np.clip(length // (4 * (channels + len(u))), 4, 40))
    past = np.vstack(
        [np.vstack([y[:, order - k : length - k], u[:, order - k : length - k]]) for k in range(1, order + 1)]
    )
    weights = np.linalg.lstsq(past.T, y[:, order:].T, rcond=1e-10)[0].T
    blocks = weights.reshape(channels, order, channels + len(u))
    size = 3 * order
    response = np.zeros((size, channels, len(u)))
    for n in range(size):
        if n < order:
            response[n] += blocks[:, n, channels:]
        for k in range(min(n, order)):
            response[n] += blocks[:, k, :channels] @ response[n - 1 - k]
    if not np.all(np.isfinite(response)):
        return np.zeros(0, complex)
    half = size // 2
    hankel = np.vstack(
        [np.hstack([response[r + c] for c in range(size - half - 1)]) for r in range(half + 1)]
    )
    return _realise(hankel, channels, stride * stretch.step)
