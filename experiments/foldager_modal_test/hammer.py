"""Blows of an impact hammer, and what force sensor and strain gauge record of them."""

from typing import NamedTuple

import numpy as np
import scipy.signal

from .rig import Rig

RATE, DURATION = 2048.0, 16.0  # samples a second, s
FORCE_NOISE, STRAIN_NOISE = 0.02, 0.5e-6  # N, and strain, standard deviations
AFTER_BLOW = 0.02  # s; the force is taken as zero from then on, as a force window does


class Record(NamedTuple):
    """Blows by rows: `times` [s] `(samples,)`, `force` [N] and `strain` `(blows, samples)`."""

    times: np.ndarray
    force: np.ndarray
    strain: np.ndarray


def strike(rig: Rig, blows: int, seed: int = 0) -> Record:
    """`blows` half-sine pulses of 1 to 3 N and 2 to 4 ms on the tip, each recorded with noise."""
    random = np.random.default_rng(seed)
    times = np.arange(int(RATE * DURATION)) / RATE
    height = random.uniform(1.0, 3.0, (blows, 1))
    width = random.uniform(2e-3, 4e-3, (blows, 1))
    phase = (times - 1e-3) / width
    force = np.where((phase > 0) & (phase < 1), height * np.sin(np.pi * phase), 0.0)
    # exact for a force that is straight between its samples
    a, b, c, d, _ = scipy.signal.cont2discrete(
        (rig.A, rig.b[:, None], rig.c[None], np.zeros((1, 1))), 1 / RATE, method="foh"
    )
    state = np.zeros((len(a), blows))
    strain = np.empty((len(times), blows))
    for k, push in enumerate(force.T):
        strain[k] = c[0] @ state + d[0, 0] * push
        state = a @ state + b * push
    heard = force + FORCE_NOISE * random.standard_normal(force.shape)
    heard[:, times > AFTER_BLOW] = 0.0
    return Record(times, heard, strain.T + STRAIN_NOISE * random.standard_normal(force.shape))
