"""Solve `M x = b` for a small symmetric positive definite M, written over scalars."""

import jax.numpy as jnp

from ..scalars import Scalar

LARGEST_UNROLLED = 12  # beyond it the unrolled form compiles slowly and a library call wins


def solve(matrix: list[list[Scalar]], right: tuple) -> tuple[Scalar, ...]:
    """`x` with `M x = b` by `M = L D L^T`; only the lower triangle `matrix[i][j], j <= i` is read.

    Over scalars a batch becomes a struct of arrays, which XLA fuses with what surrounds
    it; larger matrices go to the library's Cholesky factorisation.
    """
    if len(right) > LARGEST_UNROLLED:
        return by_library(matrix, right)
    return substitute(*factorised(matrix), right)


def by_library(matrix: list[list[Scalar]], right: tuple) -> tuple[Scalar, ...]:
    """The same by the library, of any size."""
    n = len(right)
    lower = [[matrix[max(i, j)][min(i, j)] for j in range(n)] for i in range(n)]
    factor = jnp.linalg.cholesky(jnp.stack([jnp.stack(row) for row in lower]))
    half = jnp.linalg.solve(factor, jnp.stack(right))
    return tuple(jnp.linalg.solve(factor.T, half))


def factorised(matrix: list[list[Scalar]]) -> tuple[list[list[Scalar]], list[Scalar]]:
    """Rows of L below its diagonal of ones, and the inverses of D."""
    factor: list[list[Scalar]] = []
    inverses: list[Scalar] = []  # multiplying costs a fraction of dividing
    for i, row in enumerate(matrix):
        scaled, below = [], []
        for j in range(i):
            value = row[j]
            for k in range(j):
                value = value - scaled[k] * factor[j][k]
            scaled.append(value)
            below.append(value * inverses[j])
        pivot = row[i]
        for k in range(i):
            pivot = pivot - scaled[k] * below[k]
        factor.append(below)
        inverses.append(1 / pivot)
    return factor, inverses


def substitute(factor: list[list[Scalar]], inverses: list[Scalar], right: tuple) -> tuple[Scalar, ...]:
    """`x` with `L D L^T x = right`."""
    n = len(right)
    x = list(right)
    for i in range(n):
        for k in range(i):
            x[i] = x[i] - factor[i][k] * x[k]
    x = [value * inverse for value, inverse in zip(x, inverses, strict=True)]
    for i in reversed(range(n)):
        for k in range(i + 1, n):
            x[i] = x[i] - factor[k][i] * x[k]
    return tuple(x)
