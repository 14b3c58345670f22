"""Rigs through the simulator: the runs of each, and the replay of a logged voltage in segments."""

from collections.abc import Sequence

import numpy as np

from .rigs import RUNS, SAMPLES, Rig
from .simulator import CHANNELS, FORCED, SAMPLE, run
from .structure import COORDINATES, STATES, exact_step, structure

SEGMENT = 500  # samples that a replay lasts
SEGMENTS = SAMPLES // SEGMENT
LANES = 128  # at a time, so that one program serves every number of rigs
ROWS = ("motor", "hub", "frame", "deflection", "tip", "strain", "gravity", "mode", "first_moment")
ELECTRICAL = ("resistance", "torque_constant", "back_emf_constant")


def plant_arrays(rigs: Sequence[Rig], substeps: int) -> tuple[dict[str, np.ndarray], list[dict]]:
    """What `run` needs of each rig, one lane a rig, and the structure of each."""
    parts, structures = [], []
    for rig in rigs:
        s = structure(rig.body)
        step = exact_step(s, FORCED, rig.body["foreshortening"], SAMPLE / substeps)
        values = {k: s[k] for k in ROWS} | rig.forces | rig.faults
        parts.append(values | {"step": step} | {k: rig.body[k] for k in ELECTRICAL})
        structures.append(s)
    return {k: np.stack([np.asarray(p[k], float) for p in parts], axis=-1) for k in parts[0]}, structures


def run_lanes(plant, start, reference, feedforward, disturbance, substeps):
    """`run` in portions of LANES; returns voltage [samples, lanes], readings and states likewise."""
    total = reference.shape[1]
    outputs = []
    for begin in range(0, total, LANES):
        pick = np.minimum(np.arange(begin, begin + LANES), total - 1)
        out = run(
            {k: v[..., pick] for k, v in plant.items()},
            *(a[..., pick] for a in (start, reference, feedforward, disturbance)),
            substeps=substeps,
            keep=SEGMENT,
        )
        outputs.append([np.asarray(o)[..., : min(LANES, total - begin)] for o in out])
    return tuple(np.concatenate(parts, axis=-1) for parts in zip(*outputs, strict=True))


def record(rigs: Sequence[Rig], substeps: int):
    """Both runs of every rig: voltage [samples, rigs, runs], clean readings [samples, channels, ...], states."""
    plant, _ = plant_arrays(rigs, substeps)
    plant = {k: np.repeat(v, RUNS, axis=-1) for k, v in plant.items()}
    reference = np.concatenate([r.reference for r in rigs], axis=1)
    disturbance = np.concatenate([r.disturbance for r in rigs], axis=1)
    start = np.zeros((STATES, reference.shape[1]))
    out = run_lanes(plant, start, reference, np.zeros_like(reference), disturbance, substeps)
    voltage, read, states = (o.reshape(*o.shape[:-1], len(rigs), RUNS) for o in out)
    read = read.copy()
    for number, rig in enumerate(rigs):
        for c in np.flatnonzero(rig.clock):
            read[:, c, number] = resample(read[:, c, number], 1 - rig.clock[c])
    return voltage, read, states


def resample(signal: np.ndarray, rate: float) -> np.ndarray:
    """The signal [samples, runs] as a clock of another rate would have sampled it."""
    ticks = np.arange(len(signal))
    return np.stack([np.interp(ticks * rate, ticks, s) for s in signal.T], axis=1)


def replay(plain: Sequence[Rig], rigs: Sequence[Rig], voltage, states, substeps: int = 10):
    """What the rigs `plain` read under the logged voltage of `rigs`, started anew every SEGMENT.

    Each segment starts in the state that the recorded rig had there. Returns the readings
    [samples of a segment, channels, rigs, runs, segments], and the starts likewise.
    """
    plant, homes = plant_arrays(plain, substeps)
    _, guests = plant_arrays(rigs, substeps)
    move = np.stack([translation(h, g) for h, g in zip(homes, guests, strict=True)])
    start = np.einsum("rij,sjru->irus", move, states).reshape(STATES, -1)
    count = len(rigs)
    cut = voltage.reshape(SEGMENTS, SEGMENT, count, RUNS).transpose(1, 2, 3, 0).reshape(SEGMENT, -1)
    each = RUNS * SEGMENTS
    plant = {k: np.repeat(v, each, axis=-1) for k, v in plant.items()}
    idle = {"stiffness": 0.0, "damping": 0.0}
    plant |= {k: np.full(count * each, v) for k, v in idle.items()}
    nothing = np.zeros_like(cut)
    _, read, _ = run_lanes(plant, start, nothing, cut, nothing, substeps)
    shape = (count, RUNS, SEGMENTS)
    return read.reshape(SEGMENT, len(CHANNELS), *shape), start.reshape(STATES, *shape)


def translation(home: dict, guest: dict) -> np.ndarray:
    """State of one structure -> state of another with rigid connections, by angle and link modes."""
    place = np.zeros((COORDINATES, COORDINATES))
    place[0] = guest["motor"]
    for row, column in zip(np.flatnonzero(home["mode"]), np.flatnonzero(guest["mode"]), strict=False):
        place[row, column] = 1.0
    out = np.zeros((STATES, STATES))
    out[0, 0] = 1.0
    x, v = slice(1, 1 + COORDINATES), slice(1 + COORDINATES, STATES)
    out[x, x] = out[v, v] = place
    return out
