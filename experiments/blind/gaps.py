"""How large a hidden effect is in the data: its gap, and what calibration leaves of it.

The gap of a recording is what the same plant without the effect would read under the same
voltage, against what was read, over the noise. It is taken in segments of 1 s. *Raw*: each
segment starts in the state that the recorded plant had. *Projected*: the best fit (three Gauss-Newton steps) of
every segment's initial state and of the nominal parameters has been taken out: prior-weighted,
and with parameters no further from their nominal values, in all, than one arm in RARE is, since a
calibration that needs more has found that a nominal value is wrong. Their ratio is the survival of the effect.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.optimize
import scipy.stats

from .drive import record, replay, segments, starts
from .rigs import NOISE, Rig
from .sensitivities import sensitivities
from .simulator import CHANNELS

RARE = 1000  # of arms as stated: one departs farther than a calibration may go
PASSES = 3  # of Gauss-Newton
PROBE = 1e-4  # step of a parameter's logarithm, for the derivative by it


@dataclass(frozen=True)
class Gap:
    """RMS gap over the noise floor by channel, before and after the fit."""

    raw: dict[str, float]
    projected: dict[str, float]

    @property
    def size(self) -> float:
        """The projected gap in the channel where it is largest."""
        return max(self.projected.values())

    @property
    def survival(self) -> float:
        """Share of the gap that calibration cannot absorb, over all channels."""
        raw, left = (np.linalg.norm(list(g.values())) for g in (self.raw, self.projected))
        return float(left / raw) if 0 < raw < np.inf else 0.0


def measure(plain: Sequence[Rig], rigs: Sequence[Rig], substeps: int):
    """The gap of every rig against its `plain` self; also voltages and clean readings of both runs."""
    voltage, read, states = record(rigs, substeps)
    start = starts(plain, rigs, states)
    volts, cut = segments(voltage), segments(read)
    raw: list[np.ndarray] = []
    left: list[np.ndarray] = []
    change = [np.zeros(len(rig.nominal.uncertainty)) for rig in plain]
    for _ in range(PASSES):
        left = []
        fitted = [moved(rig, d) for rig, d in zip(plain, change, strict=True)]
        expected = replay(fitted, volts, start)
        for n, rig in enumerate(fitted):
            residual = (cut[:, :, :, n] - expected[:, :, :, n]) / floor(rig)[..., None]
            residual = residual[:, logged(rig)]
            raw += [residual] if len(raw) < len(rigs) else []
            rest, change[n] = project(rig, residual, volts[:, :, n], start[:, n], change[n])
            left.append(rest)
    gaps = []
    for n, rig in enumerate(plain):
        names = [f"{CHANNELS[c]}_{j + 1}" for c, j in np.argwhere(logged(rig))]
        gaps.append(Gap(*(dict(zip(names, rms(r).tolist(), strict=True)) for r in (raw[n], left[n]))))
    return gaps, voltage, read


def moved(rig: Rig, change: np.ndarray) -> Rig:
    """The rig with its nominal parameters multiplied by `exp(change)`."""
    body = {k: v.copy() for k, v in rig.body.items()}
    for (name, j), d in zip(rig.nominal.uncertainty, change, strict=True):
        body[name][j] *= np.exp(d)
    return dataclasses.replace(rig, body=body)


def logged(rig: Rig) -> np.ndarray:
    """Which channels [channels, joints] are in the recording."""
    return np.isfinite(floor(rig))


def floor(rig: Rig) -> np.ndarray:
    """Noise floor [channels, joints]; infinite where a channel is not logged."""
    one = [NOISE[c] if c in rig.nominal.channels else np.inf for c in CHANNELS]
    return np.repeat(np.array(one)[:, None], rig.nominal.joints, axis=1)


def rms(residual: np.ndarray) -> np.ndarray:
    """Over samples and segments."""
    with np.errstate(over="ignore", invalid="ignore"):
        size = np.sqrt(np.mean(residual**2, axis=(0, 2)))
    return np.where(np.isfinite(size), size, np.inf)


def project(rig: Rig, residual: np.ndarray, voltage: np.ndarray, start: np.ndarray, change: np.ndarray):
    """One Gauss-Newton step of the fit of initial states and parameters.

    `residual` [samples, channels, segments] was found under `voltage` [samples, joints, segments]
    from `start` [states, segments], with the parameters already moved by `change` [log].
    Returns what the fit leaves of it, and the new change.
    """
    if not np.isfinite(residual).all():
        return np.full_like(residual, np.inf), change
    prior = np.array(list(rig.nominal.uncertainty.values()))
    probes = [moved(rig, PROBE * unit) for unit in np.eye(len(prior))]
    released, motion = sensitivities([rig, *probes], voltage, start, floor(rig))
    basis, _ = np.linalg.qr(released)

    def remainder(columns):
        return columns - basis @ (basis.swapaxes(1, 2) @ columns)

    slopes = np.moveaxis((motion[1:] - motion[0]) / PROBE, 0, -1)  # segments, size, parameters
    target = remainder(np.moveaxis(residual, -1, 0).reshape(*slopes.shape[:2], 1))
    columns = remainder(slopes).reshape(-1, len(prior))
    here = off(rig)
    at_nominal = target.reshape(-1) + columns @ here
    there = prior * bounded_fit(columns * prior, at_nominal)
    rest = (at_nominal - columns @ there).reshape(residual.shape[-1], *residual.shape[:2])
    return np.moveaxis(rest, 0, -1), change + there - here


def off(rig: Rig) -> np.ndarray:
    """How far [log] the parameters of a rig are from their nominal values."""
    nominal = rig.nominal
    return np.array([np.log(rig.body[name][j] / nominal.body[name][j]) for name, j in nominal.uncertainty])


def bounded_fit(columns: np.ndarray, target: np.ndarray) -> np.ndarray:
    """`d` that makes `|target - columns d|^2 + m |d|^2` least, m = 1 or what keeps |d| to what arms reach."""
    reach = scipy.stats.chi(columns.shape[1]).isf(1 / RARE)
    values, vectors = np.linalg.eigh(columns.T @ columns)
    along = vectors.T @ (columns.T @ target)
    answer = along / (values + 1)
    if np.linalg.norm(answer) > reach:
        excess = lambda m: np.linalg.norm(along / (values + np.exp(m))) - reach  # noqa: E731
        answer = along / (values + np.exp(scipy.optimize.brentq(excess, 0.0, 80.0)))
    return vectors @ answer
