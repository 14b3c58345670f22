"""Modes fitted to stretches of data: least squares in the poles, with all amplitudes eliminated.

Every channel of every stretch is an offset and a drift, decaying waves of each mode, and,
where it is driven, each mode's answer to each input. All but the poles enter linearly and
are solved for at each set of poles (variable projection, Golub and Pereyra 1973). Under
white noise this is maximum likelihood, and its covariance that of Cramer and Rao; noise
with a memory widens it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from .stretches import Stretch

MOST = 20_000  # samples used in all; longer stretches are thinned


@dataclass(frozen=True)
class Fit:
    """Modes: `frequency` [Hz] (undamped), `damping_ratio`, their `covariance` in the order f_1, zeta_1, f_2, ….

    `size`: the largest part of each mode in any channel, as a share of all that is seen;
    `explained`: the share of the variance.
    """

    frequency: np.ndarray
    damping_ratio: np.ndarray
    covariance: np.ndarray
    size: np.ndarray
    explained: float

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


def columns(stretch: Stretch, poles: np.ndarray) -> np.ndarray:
    """What every channel is made of: `(times, columns)`, the waves of a pole side by side."""
    from scipy.signal import lfilter  # noqa: PLC0415 -- takes longer to import than all else here

    t = stretch.times
    parts = [np.ones_like(t), t / t[-1]]
    for pole in poles:
        waves = [np.exp(pole * t)]
        turn = np.exp(pole * stretch.step)
        for drive in stretch.inputs:
            held = (turn - 1) / pole * np.concatenate([[0.0], (drive - drive[0])[:-1]])
            waves.append(lfilter([1.0], [1.0, -turn], held))
        for wave in waves:
            parts.append(wave.real)
            if np.imag(pole):
                parts.append(wave.imag)
    return np.stack(parts, axis=1)


def fit_modes(stretches: list[Stretch], start: np.ndarray, real: np.ndarray) -> Fit:
    """The modes nearest to `start` (f_1, zeta_1, …) that fit best, with `real` poles [rad/s] beside them."""
    thinned = [_thin(s, MOST // len(stretches)) for s in stretches]
    targets = [_scaled(s, stretches) for s in thinned]
    count = len(start)

    def residuals(x):
        poles = np.concatenate([poles_of(x[:count]), -np.exp(x[count:]).astype(complex)])
        return np.concatenate(
            [_left(columns(s, poles), y).ravel() for s, y in zip(thinned, targets, strict=True)]
        )

    first = np.concatenate([start, np.log(np.maximum(-real, 1e-6))])
    low = np.concatenate([np.tile([1e-6, -0.2], count // 2), np.full(len(real), -14.0)])
    high = np.concatenate([np.tile([np.inf, 0.95], count // 2), np.full(len(real), 14.0)])
    scale = np.concatenate(
        [np.column_stack([start[0::2], np.full(count // 2, 0.05)]).ravel(), np.ones(len(real))]
    )
    found = least_squares(
        residuals, np.clip(first, low + 1e-9, high - 1e-9), bounds=(low, high), x_scale=scale, max_nfev=60
    )
    samples = len(found.fun)
    linear = sum(columns(s, poles_of(found.x[:count])).shape[1] * len(s.outputs) for s in thinned)
    variance = found.fun @ found.fun / max(samples - linear - len(found.x), 1)
    information = found.jac.T @ found.jac
    covariance = _memory(found.fun) * variance * np.linalg.pinv(information)
    total = sum(float(np.sum((y - y.mean(axis=1, keepdims=True)) ** 2)) for y in targets)
    modes = found.x[:count]
    sizes = sizes_of(stretches, poles_of(modes), -np.exp(found.x[count:]))
    explained = 1 - float(found.fun @ found.fun) / max(total, 1e-300)
    return Fit(modes[0::2], modes[1::2], covariance[:count, :count], sizes, explained)


def _thin(stretch: Stretch, most: int) -> Stretch:
    """Every n-th sample of a free decay, so that at most `most` numbers are left; a driven one as it is."""
    every = -(-stretch.outputs.size // most)
    if every == 1 or len(stretch.inputs):
        return stretch
    return Stretch(
        stretch.step * every, stretch.outputs[:, ::every], stretch.inputs, stretch.channels, stretch.origin
    )


def _scaled(stretch: Stretch, of: list[Stretch]) -> np.ndarray:
    """Outputs in units of the largest deviation that each channel has in any of the stretches."""
    deviation = np.max([np.std(s.outputs, axis=1) for s in of], axis=0)[:, None]
    return stretch.outputs / np.maximum(deviation, 1e-300)


def _left(basis: np.ndarray, y: np.ndarray) -> np.ndarray:
    q, _ = np.linalg.qr(basis / np.maximum(np.linalg.norm(basis, axis=0), 1e-300))
    return y - (y @ q) @ q.T


def sizes_of(stretches: list[Stretch], modes: np.ndarray, real: np.ndarray) -> np.ndarray:
    """Largest excursion of each mode's part in any channel, as a share of the data's own."""
    sizes = np.zeros(len(modes))
    for stretch in (_thin(s, MOST // len(stretches)) for s in stretches):
        y = _scaled(stretch, stretches)
        basis = columns(stretch, np.concatenate([modes, real]))
        weights = np.linalg.lstsq(basis, y.T, rcond=1e-12)[0]
        width = 2 * (1 + len(stretch.inputs))
        span = np.maximum(np.ptp(y, axis=1), 1e-300)
        for k in range(len(modes)):
            own = slice(2 + k * width, 2 + (k + 1) * width)
            part = basis[:, own] @ weights[own]
            sizes[k] = max(sizes[k], float(np.max(np.ptp(part, axis=0) / span)))
    return sizes


def _memory(residual: np.ndarray) -> float:
    """By how much the variance of a mean grows because neighbouring residuals are alike; at least 1."""
    centred = residual - residual.mean()
    power = centred @ centred
    if power <= 0:
        return 1.0
    lags = np.array([centred[:-k] @ centred[k:] / power for k in range(1, min(200, len(centred) // 4))])
    end = int(np.argmax(lags < 0.05)) if np.any(lags < 0.05) else len(lags)
    return float(1 + 2 * np.sum(np.maximum(lags[:end], 0.0)))
