"""How large a hidden effect is in the data: its gap, and what calibration leaves of it.

The gap of a recording is what the same plant without the effect would read under the same
voltage, against what was read, over the noise. It is taken in segments of 1 s. *Raw*: each
segment starts in the state that the recorded plant had. *Projected*: the best linear fit of
every segment's initial state and of the nominal parameters has been taken out: prior-weighted,
and moving the parameters no further than REACH standard deviations in all, since a calibration
that needs more has found that a nominal value is wrong. Their ratio is the survival of the effect.
"""

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
PROBE = 1e-4  # relative step of a parameter, for its derivative


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
    expected = replay(plain, rigs, voltage, states)
    count = len(rigs)
    cut = read.reshape(SEGMENTS, SEGMENT, len(CHANNELS), count, RUNS).transpose(1, 2, 3, 4, 0)
    volts = voltage.reshape(SEGMENTS, SEGMENT, count, RUNS).transpose(2, 1, 3, 0)
    gaps = []
    for number, rig in enumerate(plain):
        pick = [CHANNELS.index(c) for c in rig.nominal.channels]
        floor = np.array([NOISE[c] for c in rig.nominal.channels])
        residual = (cut[:, pick, number] - expected[:, pick, number]) / floor[:, None, None]
        residual = residual.reshape(SEGMENT, len(pick), RUNS * SEGMENTS)
        left = project(rig, residual, volts[number].reshape(SEGMENT, -1))
        gaps.append(
            Gap(*(dict(zip(rig.nominal.channels, rms(r).tolist(), strict=True)) for r in (residual, left)))
        )
    return gaps, voltage, read


def rms(residual: np.ndarray) -> np.ndarray:
    size = np.sqrt(np.mean(residual**2, axis=(0, 2)))
    return np.where(np.isfinite(size), size, np.inf)


def project(rig: Rig, residual: np.ndarray, voltage: np.ndarray) -> np.ndarray:
    """`residual` [samples, channels, segments] less its best fit by initial states and parameters."""
    if not np.isfinite(residual).all():
        return np.full_like(residual, np.inf)
    names = list(rig.nominal.uncertainty)
    bodies = [rig.body] + [rig.body | {n: rig.body[n] * (1 + PROBE)} for n in names]
    structures = [structure(b) for b in bodies]
    used = np.flatnonzero(np.abs(structures[0]["system"]).sum(axis=1) > 0)
    floor = np.array([NOISE[c] for c in rig.nominal.channels])
    pick = [CHANNELS.index(c) for c in rig.nominal.channels]
    rows = np.stack([readings(s)[pick][:, used] for s in structures]) / floor[:, None]
    flow = np.stack([transition(s["system"]) for s in structures])
    step, push = flow[:, used][:, :, used], flow[:, used, STATES:]

    free = np.eye(len(used))
    state = np.zeros((len(structures), len(used), voltage.shape[1]))
    start, forced = [], []
    for volts in voltage:
        start.append(rows[0] @ free)
        forced.append(rows @ state)
        free = step[0] @ free
        state = step @ state + push * volts
    size = residual.shape[0] * residual.shape[1]
    basis, _ = np.linalg.qr(np.stack(start).reshape(size, -1))
    answers = np.stack(forced)  # samples, structures, channels, segments
    slopes = (answers[:, 1:] - answers[:, :1]) / PROBE
    columns = slopes.transpose(0, 2, 1, 3).reshape(size, -1)
    columns = (columns - basis @ (basis.T @ columns)).reshape(size, len(names), -1)
    target = residual.reshape(size, -1)
    target = target - basis @ (basis.T @ target)
    prior = np.array([rig.nominal.uncertainty[n] for n in names])
    columns = columns.transpose(0, 2, 1).reshape(-1, len(names))
    change = prior * bounded_fit(columns * prior, target.reshape(-1))
    return (target.reshape(-1) - columns @ change).reshape(residual.shape)


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
