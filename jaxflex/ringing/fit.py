"""Modes fitted to stretches of data: least squares in the poles, with all amplitudes eliminated.

Every channel of every stretch is an offset and a drift, decaying waves of each mode, and,
where it is driven, each input itself and each mode's answer to it. The input itself makes
up for whether it was held between samples, for delays of less than a sample, and for what
follows it at once, as an acceleration does. All but the poles enter linearly and
are solved for at each set of poles (variable projection, Golub and Pereyra 1973). Under
white noise this is maximum likelihood, and its covariance that of Cramer and Rao; noise
with a memory widens it.
"""

from dataclasses import dataclass

import numpy as np
import scipy  # whose parts, imported when first used, take longer to import than all here

from .stretches import Stretch

MOST = 20_000  # samples used in all; of longer stretches every n-th
CLEAN = 1e-4  # share of the variance below which nothing is told from noise


@dataclass(frozen=True)
class Fit:
    """Modes: `frequency` [Hz] (undamped), `damping_ratio`, their `covariance` in the order f_1, zeta_1, f_2, ….

    `size`: the largest part of each mode in any channel, as a share of all that is seen;
    `ringing`: of a driven run, the mode's share of all ringing after a step of the input;
    else the size. `explained`: the share of the variance; `misfit`: what is left, as a
    multiple of the noise; `samples` fitted, and parameters `added` by each mode.
    """

    frequency: np.ndarray
    damping_ratio: np.ndarray
    covariance: np.ndarray
    size: np.ndarray
    ringing: np.ndarray
    explained: float
    misfit: float
    samples: int
    added: int

    @property
    def modes(self) -> np.ndarray:
        """Frequencies and damping ratios in a row: f_1, zeta_1, f_2, …."""
        return np.column_stack([self.frequency, self.damping_ratio]).ravel()

    @property
    def frequency_std(self) -> np.ndarray:
        """Standard deviations of the frequencies [Hz]."""
        return np.sqrt(np.diag(self.covariance)[0::2])

    @property
    def damping_std(self) -> np.ndarray:
        """Standard deviations of the damping ratios."""
        return np.sqrt(np.diag(self.covariance)[1::2])


def poles_of(modes: np.ndarray) -> np.ndarray:
    """Poles [rad/s] of modes given as f_1, zeta_1, f_2, …."""
    omega, zeta = 2 * np.pi * modes[0::2], modes[1::2]
    return omega * (-zeta + 1j * np.sqrt(1 - zeta**2))


def columns(stretch: Stretch, poles: np.ndarray, every: int = 1) -> np.ndarray:
    """What every channel is made of at `every` n-th sample: `(times, columns)`, the waves of a pole side by side."""
    t = stretch.times
    drives = stretch.inputs - stretch.inputs[:, :1]
    parts = [np.ones_like(t), t / t[-1], *drives]
    for pole in poles:
        waves = [np.exp(pole * (t - t[-1] if np.real(pole) > 0 else t))]
        turn = np.exp(pole * stretch.step)
        for drive in drives:
            held = (turn - 1) / pole * np.concatenate([[0.0], drive[:-1]])
            waves.append(scipy.signal.lfilter([1.0], [1.0, -turn], held))
        for wave in waves:
            parts.append(wave.real)
            if np.imag(pole):
                parts.append(wave.imag)
    return np.stack([part[::every] for part in parts], axis=1)


def fit_modes(stretches: list[Stretch], start: np.ndarray, real: np.ndarray) -> Fit:
    """The modes nearest to `start` (f_1, zeta_1, …) that fit best, with `real` poles [rad/s] beside them."""
    every = sparse(stretches, MOST)
    targets = [y[:, ::n] for y, n in zip(scaled(stretches), every, strict=True)]
    count = len(start)

    def all_poles(x):
        return np.concatenate([poles_of(x[:count]), -np.exp(x[count:]).astype(complex)])

    def residuals(x):
        poles = all_poles(x)
        return np.concatenate(
            [
                _left(columns(s, poles, n), y).ravel()
                for s, y, n in zip(stretches, targets, every, strict=True)
            ]
        )

    first = np.concatenate([start, np.log(np.maximum(-real, 1e-6))])

    def slopes(x):
        """Of the residuals, but for what of them stays within the columns (Kaufman 1975)."""
        steps = 1e-6 * np.maximum(np.abs(x), 1e-3)
        rows = []
        for stretch, y, n in zip(stretches, targets, every, strict=True):
            basis = columns(stretch, all_poles(x), n)
            weights = _weights(basis, y)
            first, width = 2 + len(stretch.inputs), 1 + len(stretch.inputs)
            parts = []
            for i, step in enumerate(steps):
                near = all_poles(x + step * (np.arange(len(x)) == i))
                k = i // 2 if i < count else count // 2 + i - count
                start = first + width * (2 * k if i < count else count + i - count)
                own = slice(start, start + (2 * width if i < count else width))
                moved = columns(stretch, near[k : k + 1], n)[:, first:] - basis[:, own]
                parts.append(moved @ weights[own] / step)
            left = _left(basis, np.concatenate(parts, axis=1).T).reshape(len(x), -1)
            rows.append(-left.T)
        return np.concatenate(rows)

    longest = max(s.times[-1] for s in stretches)
    growth = np.maximum(-0.2, -10 / (2 * np.pi * start[0::2] * longest))
    slowest = np.column_stack([np.full(count // 2, 1e-6), growth]).ravel()
    low = np.concatenate([slowest, np.full(len(real), -14.0)])
    high = np.concatenate([np.tile([0.5 / stretches[0].step, 0.95], count // 2), np.full(len(real), 14.0)])
    scale = np.concatenate(
        [np.column_stack([start[0::2], np.full(count // 2, 0.05)]).ravel(), np.ones(len(real))]
    )
    found = scipy.optimize.least_squares(
        residuals,
        np.clip(first, low + 1e-9, high - 1e-9),
        slopes,  # pyright: ignore
        (low, high),
        x_scale=scale,
        max_nfev=60,
    )
    samples = len(found.fun)
    width = [2 + len(s.inputs) + (count + len(real)) * (1 + len(s.inputs)) for s in stretches]
    linear = sum(wide * len(s.outputs) for wide, s in zip(width, stretches, strict=True))
    variance = found.fun @ found.fun / max(samples - linear - len(found.x), 1)
    information = found.jac.T @ found.jac
    covariance = _memory(found.fun) * variance * np.linalg.pinv(information)
    total = sum(float(np.sum((y - y.mean(axis=1, keepdims=True)) ** 2)) for y in targets)
    modes = found.x[:count]
    sizes, rings = sizes_of(stretches, poles_of(modes), -np.exp(found.x[count:]))
    explained = 1 - float(found.fun @ found.fun) / max(total, 1e-300)
    misfit = variance / max(_noise(stretches), CLEAN * total / samples, 1e-300)
    added = 2 + sum(2 * (1 + len(s.inputs)) * len(s.outputs) for s in stretches)
    return Fit(
        modes[0::2], modes[1::2], covariance[:count, :count], sizes, rings, explained, misfit, samples, added
    )


def sparse(stretches: list[Stretch], most: int) -> list[int]:
    """Of each stretch every how manieth sample to take, so that they have at most `most` numbers in all."""
    return [-(-s.outputs.size * len(stretches) // most) for s in stretches]


def scaled(stretches: list[Stretch]) -> list[np.ndarray]:
    """Outputs in units of the largest deviation that each channel has in any of the stretches."""
    deviation = np.max([np.std(s.outputs, axis=1) for s in stretches], axis=0)[:, None]
    return [s.outputs / np.maximum(deviation, 1e-300) for s in stretches]


def _lengths(basis: np.ndarray) -> np.ndarray:
    return np.maximum(np.linalg.norm(basis, axis=0), 1e-300)


def _weights(basis: np.ndarray, y: np.ndarray) -> np.ndarray:
    lengths = _lengths(basis)
    return np.linalg.lstsq(basis / lengths, y.T, rcond=1e-12)[0] / lengths[:, None]


def _left(basis: np.ndarray, y: np.ndarray) -> np.ndarray:
    q, _ = np.linalg.qr(basis / _lengths(basis))
    return y - (y @ q) @ q.T


def sizes_of(stretches: list[Stretch], modes: np.ndarray, real: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of each mode the largest excursion in any channel, as a share of the data's own, and its share of a ringing."""
    sizes, rings = np.zeros(len(modes)), np.zeros(len(modes))
    for stretch, whole, every in zip(stretches, scaled(stretches), sparse(stretches, MOST), strict=True):
        y = whole[:, ::every]
        basis = columns(stretch, np.concatenate([modes, real]), every)
        weights = _weights(basis, y)
        first, width = 2 + len(stretch.inputs), 2 * (1 + len(stretch.inputs))
        span = np.maximum(np.ptp(y, axis=1), 1e-300)
        for k in range(len(modes)):
            own = slice(first + k * width, first + (k + 1) * width)
            part = basis[:, own] @ weights[own]
            sizes[k] = max(sizes[k], float(np.max(np.ptp(part, axis=0) / span)))
            # a step makes a wave of 1 / |pole| of each input's
            waves = np.hypot(weights[own][2::2], weights[own][3::2]) / np.abs(modes[k])
            rings[k] = max(rings[k], float(np.max(waves, initial=0.0)))
    return sizes, rings / rings.sum() if rings.any() else sizes


def _noise(stretches: list[Stretch]) -> float:
    """Variance of white noise: its power in the upper half of the band, where nothing should ring."""
    powers, counts = [], []
    for stretch, y in zip(stretches, scaled(stretches), strict=True):
        window = np.hanning(y.shape[1])
        centred = y - y.mean(axis=1, keepdims=True)
        power = np.abs(np.fft.rfft(centred * window, axis=1)) ** 2 / np.sum(window**2)
        # the median of a power that is exponentially distributed is log 2 of its mean
        powers.append(np.median(power[:, power.shape[1] // 2 :], axis=1).mean() / np.log(2))
        counts.append(len(stretch.times))
    return float(np.average(powers, weights=counts))


def _memory(residual: np.ndarray) -> float:
    """By how much the variance of a mean grows because neighbouring residuals are alike; at least 1."""
    centred = residual - residual.mean()
    power = centred @ centred
    if power <= 0:
        return 1.0
    lags = np.array([centred[:-k] @ centred[k:] / power for k in range(1, min(200, len(centred) // 4))])
    end = int(np.argmax(lags < 0.05)) if np.any(lags < 0.05) else len(lags)
    return float(1 + 2 * np.sum(np.maximum(lags[:end], 0.0)))
