"""How readings answer to initial states and parameters: exactly where a plant is linear, else by differences."""

from collections.abc import Sequence

import numpy as np

from .drive import replay
from .rigs import Rig

SMALL = 1e-4  # of a coordinate [rad, m kg^0.5]; ten times that of a rate, a hundred times of a current


def sensitivities(rigs: Sequence[Rig], voltage: np.ndarray, start: np.ndarray, floor: np.ndarray):
    """Readings over the noise `floor` [channels, joints], infinite where a channel is not logged.

    Under `voltage` [samples, joints, segments] from `start` [states, segments]. Returns, over
    (samples x channels) flattened, the answer of the first rig to each initial state [segments, or one
    for all, size, states], and the motion of each rig [rigs, segments, size].
    """
    physics = rigs[0].nominal.physics
    if hasattr(physics, "linear_sensitivities"):
        return physics.linear_sensitivities([r.body for r in rigs], voltage, start, floor)
    logged = np.isfinite(floor)
    used, moves = physics.free_states(SMALL)
    begins = np.repeat(start[:, None], len(rigs) + len(used), axis=1)
    begins[:, len(rigs) :] += moves.T[:, :, None]
    volts = np.repeat(voltage[:, :, None], begins.shape[1], axis=2)
    read = replay([*rigs, *[rigs[0]] * len(used)], volts, begins)
    scaled = (read / floor[..., None, None])[:, logged]  # samples, channels, rigs, segments
    flat = scaled.transpose(2, 3, 0, 1).reshape(begins.shape[1], begins.shape[2], -1)
    motion, moved = flat[: len(rigs)], flat[len(rigs) :]
    sizes = np.abs(moves).max(axis=1)[:, None, None]
    return np.moveaxis((moved - motion[0]) / sizes, 0, -1), motion
