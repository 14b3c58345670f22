"""Which of many candidate poles a motion is made of: the one that explains most, then the next.

Orthogonal matching pursuit (Pati, Rezaiifar and Krishnaprasad 1993), a block of columns a pole.
"""

import numpy as np

from .fit import columns, scaled, sparse
from .stretches import Stretch

SAMPLES = 6000  # that candidates are judged on


def next_pole(found: list[Stretch], candidates: np.ndarray, there: np.ndarray) -> np.ndarray:
    """The one of `candidates` [rad/s] that explains most of what the poles `there` leave.

    None, as an empty array, if that is no more than it would explain of noise.
    """
    gains, power, samples, free = np.zeros(len(candidates)), 0.0, 0, 0
    for stretch, whole, every in zip(found, scaled(found), sparse(found, SAMPLES), strict=True):
        y = whole[:, ::every].T
        basis = np.linalg.qr(_normed(columns(stretch, there, every)))[0]
        left = y - basis @ (basis.T @ y)
        power, samples = power + float(np.sum(left**2)), samples + left.size
        constant = 2 + len(stretch.inputs)
        for k, pole in enumerate(candidates):
            q = _beyond(basis, _normed(columns(stretch, pole[None], every)[:, constant:]))
            gains[k] += float(np.sum((q.T @ left) ** 2))
        free += 2 * (1 + len(stretch.inputs)) * left.shape[1]
    if not len(gains) or gains.max() <= power * least_gain(free, samples):
        return candidates[:0]
    return candidates[[np.argmax(gains)]]


def least_gain(parameters: int, samples: int) -> float:
    """Share of what is left that as many more parameters have to explain (Schwarz 1978)."""
    return parameters * np.log(samples) / samples


def _normed(block: np.ndarray) -> np.ndarray:
    return block / np.maximum(np.linalg.norm(block, axis=0), 1e-300)


def _beyond(basis: np.ndarray, block: np.ndarray) -> np.ndarray:
    """Orthonormal columns for what of `block` is outside the span of `basis`."""
    outside = block - basis @ (basis.T @ block)
    q, r = np.linalg.qr(outside - basis @ (basis.T @ outside))
    return q[:, np.abs(np.diag(r)) > 1e-8]
