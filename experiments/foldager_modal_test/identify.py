"""From records of blows to frequencies and damping ratios."""

from typing import NamedTuple

import numpy as np
import scipy.signal

from .hammer import Record

LOW, HIGH = 4.0, 235.0  # Hz, the range searched
PROMINENCE, APART = 8.0, 3.0  # dB over its surroundings, and Hz from the next, of a peak
COHERENT, AROUND = 0.9, 9  # least mean coherence of a peak, over so many lines of the spectrum
ITERATIONS = 8


class Peak(NamedTuple):
    """Undamped natural frequency [Hz] and damping ratio."""

    frequency: float
    damping_ratio: float


def frequency_response(record: Record) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frequencies [Hz], strain over force [1/N] by the H1 estimator over all blows, and coherence."""
    force, strain = np.fft.rfft(record.force), np.fft.rfft(record.strain)
    step = record.times[1] - record.times[0]
    cross = np.sum(np.conj(force) * strain, axis=0)
    of_force, of_strain = np.sum(np.abs(force) ** 2, axis=0), np.sum(np.abs(strain) ** 2, axis=0)
    coherence = np.abs(cross) ** 2 / (of_force * of_strain)
    return np.fft.rfftfreq(len(record.times), step), cross / of_force, coherence


def peaks(frequencies: np.ndarray, response: np.ndarray, coherence: np.ndarray) -> list[Peak]:
    """The modes that stand out of `response` where all blows agree, ascending."""
    inside = (frequencies > LOW) & (frequencies < HIGH)
    f, level = frequencies[inside], 20 * np.log10(np.abs(response[inside]))
    bin_width = f[1] - f[0]
    tops, _ = scipy.signal.find_peaks(level, prominence=PROMINENCE, distance=int(APART / bin_width))
    around = np.convolve(coherence[inside], np.full(AROUND, 1 / AROUND), mode="same")
    agreed = tops[around[tops] > COHERENT]
    return [fit_peak(frequencies, response, f[top]) for top in agreed]


def fit_peak(frequencies: np.ndarray, response: np.ndarray, near: float) -> Peak:
    """The mode near `near` [Hz], by a rational fraction fitted to the response around it.

    `(b0 + b1 s + b2 s^2) / (a0 + a1 s + s^2)` with s in units of the peak: the numerator
    also takes up what the other modes add. Each pass weights the equation error by the
    last denominator (Sanathanan and Koerner 1963), and takes in a band of three
    half-power widths.
    """
    bin_width = frequencies[1] - frequencies[0]
    half_width = max(6 * bin_width, 0.03 * near)
    a0, a1 = 1.0, half_width / near
    for _ in range(ITERATIONS):
        band = np.abs(frequencies - near) < half_width
        s, h = 1j * frequencies[band] / near, response[band]
        weight = 1 / np.abs(a0 + a1 * s + s**2)
        columns = np.stack([h, s * h, -np.ones_like(s), -s, -(s**2)], axis=1) * weight[:, None]
        right = -(s**2) * h * weight
        # the numerator's coefficients are real because the response of a real signal is
        left = np.concatenate([columns.real, columns.imag])
        size = np.abs(left).max(axis=0)
        found = np.linalg.lstsq(left / size, np.concatenate([right.real, right.imag]), rcond=None)[0] / size
        a0, a1 = found[:2]
        ratio = a1 / (2 * np.sqrt(a0))
        half_width = max(6 * bin_width, 3 * abs(ratio) * near)
    return Peak(float(near * np.sqrt(a0)), float(ratio))
