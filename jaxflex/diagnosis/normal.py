"""Least squares whose starts have been eliminated."""

from dataclasses import dataclass, field

import numpy as np


@dataclass
class Normal:
    """Least squares in the columns alone, the starts eliminated: `N d = g`.

    `cost` is that of the starts and columns as they are; `promise` by how much the starts
    alone would lower it.
    """

    matrix: np.ndarray
    vector: np.ndarray
    cost: float
    promise: float
    count: int
    back: list = field(default_factory=list)  # what gives the starts once d is known

    def __add__(self, other: "Normal") -> "Normal":
        return Normal(
            self.matrix + other.matrix,
            self.vector + other.vector,
            self.cost + other.cost,
            self.promise + other.promise,
            self.count + other.count,
            [*self.back, *other.back],
        )


@np.errstate(over="ignore")  # slopes of a lost motion have no bounds; what cannot be solved is infinite
def solve(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """`matrix^-1 right` of a symmetric matrix, or the smallest of its solutions where it is singular."""
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    tidy = matrix / np.outer(scale, scale)
    tall = (right.T / scale).T
    try:
        found = np.linalg.solve(tidy, tall)
    except np.linalg.LinAlgError:
        found = np.full_like(tall, np.nan)
    if not np.isfinite(found).all():
        if not np.isfinite(tidy).all() or not np.isfinite(tall).all():
            return np.full_like(tall, np.inf)
        found = np.linalg.lstsq(tidy, tall, rcond=1e-13)[0]
    return (found.T / scale).T


def solve_all(matrices: np.ndarray, right: np.ndarray) -> np.ndarray:
    """`solve` of each of a stack of matrices."""
    scale = np.sqrt(np.maximum(np.diagonal(matrices, axis1=1, axis2=2), 1e-300))
    try:
        found = np.linalg.solve(matrices / (scale[:, :, None] * scale[:, None]), right / scale[..., None])
        found /= scale[..., None]
    except np.linalg.LinAlgError:
        found = np.full_like(right, np.nan)
    for k in np.flatnonzero(~np.isfinite(found).all((1, 2))):
        found[k] = solve(matrices[k], right[k])
    return found
