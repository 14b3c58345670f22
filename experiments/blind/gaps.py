"""How large a hidden effect is in the data: its gap, and what calibration leaves of it.

The gap of a recording is what the same plant without the effect would read under the same
voltage, against what was read, over the noise. It is taken in segments of 1 s. *Raw*: each
segment starts in the state that the recorded plant had. *Projected*: the best fit (three Gauss-Newton steps) of
every segment's initial state and of the nominal parameters has been taken out: prior-weighted,
and moving the parameters no further than REACH standard deviations in all, since a calibration
that needs more has found that a nominal value is wrong. Their ratio is the survival of the effect.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.optimize

from .drive import SEGMENT, SEGMENTS, record, replay
from .rigs import NOISE, RUNS, Rig
from .simulator import CHANNELS, SAMPLE
from .structure import STATES, readings, structure

REACH = 3.0
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
        return float(left / raw) if raw > 0 else 0.0


def measure(plain: Sequence[Rig], rigs: Sequence[Rig], substeps: int):
    """The gap of every rig against its `plain` self; also voltage and clean readings of both runs."""
    voltage, read, states = record(rigs, substeps)
    count = len(rigs)
    cut = read.reshape(SEGMENTS, SEGMENT, len(CHANNELS), count, RUNS).transpose(1, 2, 3, 4, 0)
    volts = voltage.reshape(SEGMENTS, SEGMENT, count, RUNS).transpose(2, 1, 3, 0)
    raw: list[np.ndarray] = []
    left: list[np.ndarray] = []
    change = [np.zeros(len(rig.nominal.uncertainty)) for rig in plain]
    for _ in range(PASSES):
        left = []
        fitted = [moved(rig, d) for rig, d in zip(plain, change, strict=True)]
        expected, starts = replay(fitted, rigs, voltage, states)
        for n, rig in enumerate(fitted):
            pick, floor = logged(rig)
            residual = (cut[:, pick, n] - expected[:, pick, n]) / floor[:, None, None]
            residual = residual.reshape(SEGMENT, len(pick), RUNS * SEGMENTS)
            raw += [residual] if len(raw) < count else []
            start = starts[:, n].reshape(len(starts), -1)
            rest, change[n] = project(rig, residual, volts[n].reshape(SEGMENT, -1), start, change[n])
            left.append(rest)
    gaps = []
    for n, rig in enumerate(plain):
        sizes = (dict(zip(rig.nominal.channels, rms(r).tolist(), strict=True)) for r in (raw[n], left[n]))
        gaps.append(Gap(*sizes))
    return gaps, voltage, read


def moved(rig: Rig, change: np.ndarray) -> Rig:
    """The rig with its nominal parameters multiplied by `exp(change)`."""
    names = rig.nominal.uncertainty
    body = {n: rig.body[n] * float(np.exp(d)) for n, d in zip(names, change, strict=True)}
    return dataclasses.replace(rig, body=rig.body | body)


def logged(rig: Rig) -> tuple[list[int], np.ndarray]:
    """Indices and noise floors of the channels in the recording."""
    channels = rig.nominal.channels
    return [CHANNELS.index(c) for c in channels], np.array([NOISE[c] for c in channels])


def rms(residual: np.ndarray) -> np.ndarray:
    size = np.sqrt(np.mean(residual**2, axis=(0, 2)))
    return np.where(np.isfinite(size), size, np.inf)


def project(rig: Rig, residual: np.ndarray, voltage: np.ndarray, start: np.ndarray, change: np.ndarray):
    """One Gauss-Newton step of the fit of initial states and parameters.

    `residual` [samples, channels, segments] was found under `voltage` [samples, segments]
    from `start` [states, segments], with the parameters already moved by `change` [log].
    Returns what the fit leaves of it, and the new change.
    """
    if not np.isfinite(residual).all():
        return np.full_like(residual, np.inf), change
    names = list(rig.nominal.uncertainty)
    probes = [moved(rig, PROBE * unit) for unit in np.eye(len(names))]
    structures = [structure(r.body) for r in (rig, *probes)]
    used = np.flatnonzero(np.abs(structures[0]["system"]).sum(axis=1) > 0)
    pick, floor = logged(rig)
    rows = np.stack([readings(s)[pick][:, used] for s in structures]) / floor[:, None]
    flow = np.stack([transition(s["system"]) for s in structures])
    step, push = flow[:, used][:, :, used], flow[:, used, STATES:]

    free = np.eye(len(used))
    state = np.repeat(start[None, used], len(structures), axis=0)
    released, answers = [], []
    for volts in voltage:
        released.append(rows[0] @ free)
        answers.append(rows @ state)
        free = step[0] @ free
        state = step @ state + push * volts
    size = residual.shape[0] * residual.shape[1]
    basis, _ = np.linalg.qr(np.stack(released).reshape(size, -1))
    moves = np.stack(answers)  # samples, structures, channels, segments
    slopes = (moves[:, 1:] - moves[:, :1]) / PROBE
    columns = slopes.transpose(0, 2, 1, 3).reshape(size, -1)
    columns = (columns - basis @ (basis.T @ columns)).reshape(size, len(names), -1)
    target = residual.reshape(size, -1)
    target = target - basis @ (basis.T @ target)
    prior = np.array([rig.nominal.uncertainty[n] for n in names])
    columns = columns.transpose(0, 2, 1).reshape(-1, len(names))
    unmoved = target.reshape(-1) + columns @ change
    change = prior * bounded_fit(columns * prior, unmoved)
    return (unmoved - columns @ change).reshape(residual.shape), change


def bounded_fit(columns: np.ndarray, target: np.ndarray) -> np.ndarray:
    """`d` that makes `|target - columns d|^2 + m |d|^2` least, m = 1 or what keeps |d| to REACH."""
    values, vectors = np.linalg.eigh(columns.T @ columns)
    along = vectors.T @ (columns.T @ target)
    answer = along / (values + 1)
    if np.linalg.norm(answer) > REACH:
        excess = lambda m: np.linalg.norm(along / (values + np.exp(m))) - REACH  # noqa: E731
        answer = along / (values + np.exp(scipy.optimize.brentq(excess, 0.0, 80.0)))
    return vectors @ answer


def transition(system: np.ndarray) -> np.ndarray:
    """[state, voltage] -> state a sample later, the voltage held."""
    block = np.zeros((STATES + 1, STATES + 1))
    block[:STATES] = system
    return scipy.linalg.expm(block * SAMPLE)[:STATES]
