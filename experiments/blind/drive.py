"""Rigs through the simulator: the runs of each, and the replay of a logged voltage in segments."""

from collections.abc import Sequence

import numpy as np

from .rigs import MOTOR, RUNS, SAMPLES, Rig
from .simulator import CHANNELS, SAMPLE, run

SEGMENT = 500  # samples that a replay lasts
SEGMENTS = SAMPLES // SEGMENT
LANES = 128  # at a time, so that one program serves every number of rigs


def plant_arrays(rigs: Sequence[Rig], substeps: int) -> dict[str, dict[str, np.ndarray]]:
    """What `run` needs of each rig, one lane a rig."""
    parts = []
    for rig in rigs:
        arrays = rig.nominal.physics.prepare(rig.body, SAMPLE / substeps)
        joint = rig.laws | {k: rig.body[k] for k in MOTOR}
        parts.append({"joint": joint, "fault": rig.faults, "arm": arrays | rig.arm})
    return {
        group: {k: np.stack([np.asarray(p[group][k], float) for p in parts], axis=-1) for k in values}
        for group, values in parts[0].items()
    }


def run_lanes(physics, plant, start, reference, feedforward, disturbance, substeps):
    """`run` in portions of LANES."""
    total = reference.shape[-1]
    outputs = []
    for begin in range(0, total, LANES):
        pick = np.minimum(np.arange(begin, begin + LANES), total - 1)
        portion = {g: {k: v[..., pick] for k, v in values.items()} for g, values in plant.items()}
        signals = (a[..., pick] for a in (start, reference, feedforward, disturbance))
        out = run(physics, portion, *signals, substeps=substeps, keep=SEGMENT)
        outputs.append([np.asarray(o)[..., : min(LANES, total - begin)] for o in out])
    return tuple(np.concatenate(parts, axis=-1) for parts in zip(*outputs, strict=True))


def repeated(plant, times: int):
    """Every lane so many times over."""
    return {g: {k: np.repeat(v, times, axis=-1) for k, v in values.items()} for g, values in plant.items()}


def record(rigs: Sequence[Rig], substeps: int):
    """Both runs of every rig.

    Returns voltages [samples, joints, rigs, runs], clean readings [samples, channels, joints, rigs,
    runs], and the state at the beginning of each segment [segments, states, rigs, runs].
    """
    physics, count = rigs[0].nominal.physics, len(rigs)
    plant = repeated(plant_arrays(rigs, substeps), RUNS)
    reference, disturbance = (
        np.stack([getattr(r, name) for r in rigs], axis=1)
        .transpose(0, 3, 1, 2)
        .reshape(SAMPLES, -1, count * RUNS)
        for name in ("reference", "disturbance")
    )
    start = np.zeros((physics.STATES, count * RUNS))
    out = run_lanes(physics, plant, start, reference, np.zeros_like(reference), disturbance, substeps)
    voltage, read, states = (o.reshape(*o.shape[:-1], count, RUNS) for o in out)
    read = read.copy()
    for number, rig in enumerate(rigs):
        for c, j in np.argwhere(rig.clock):
            read[:, c, j, number] = resample(read[:, c, j, number], 1 - rig.clock[c, j])
    return voltage, read, states


def resample(signal: np.ndarray, rate: float) -> np.ndarray:
    """The signal [samples, runs] as a clock of another rate would have sampled it."""
    ticks = np.arange(len(signal))
    return np.stack([np.interp(ticks * rate, ticks, s) for s in signal.T], axis=1)


def segments(signal: np.ndarray) -> np.ndarray:
    """[samples, ..., runs] -> [samples of a segment, ..., runs x segments]."""
    cut = signal.reshape(SEGMENTS, SEGMENT, *signal.shape[1:])
    return np.moveaxis(cut, 0, -1).reshape(SEGMENT, *signal.shape[1:-1], -1)


def starts(plain: Sequence[Rig], rigs: Sequence[Rig], states: np.ndarray) -> np.ndarray:
    """The states of `rigs` [segments, states, rigs, runs] as rigs with rigid connections would be.

    Returns [states, rigs, runs x segments].
    """
    physics = plain[0].nominal.physics
    moved = [
        np.einsum("ij,sjr->irs", physics.translation(a.body, b.body), states[:, :, n])
        for n, (a, b) in enumerate(zip(plain, rigs, strict=True))
    ]
    return np.stack(moved, axis=1).reshape(states.shape[1], len(rigs), -1)


def replay(plain: Sequence[Rig], voltage: np.ndarray, start: np.ndarray):
    """Readings [samples of a segment, channels, joints, rigs, segments] under logged voltages.

    `voltage` [samples of a segment, joints, rigs, segments], `start` [states, rigs, segments].
    """
    physics, count = plain[0].nominal.physics, len(plain)
    each, substeps = start.shape[-1], physics.REPLAY
    plant = repeated(plant_arrays(plain, substeps), each)
    for gain in ("stiffness", "damping"):
        plant["joint"][gain] = np.zeros_like(plant["joint"][gain])
    volts = voltage.reshape(*voltage.shape[:2], -1)
    nothing = np.zeros_like(volts)
    flat = start.reshape(len(start), -1)
    _, read, _ = run_lanes(physics, plant, flat, nothing, volts, nothing, substeps)
    return read.reshape(SEGMENT, len(CHANNELS), -1, count, each)
