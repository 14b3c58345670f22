"""Solve `M x = b` for a small symmetric positive definite M, written over scalars."""

import jax.numpy as jnp

from ..scalars import Scalar

LARGEST_UNROLLED = 12  # beyond it the unrolled form compiles slowly and a library call wins


def solve(matrix: list[list[Scalar]], right: tuple) -> tuple[Scalar, ...]:
    """`x` with `M x = b` by `M = L D L^T`; only the lower triangle `matrix[i][j], j <= i` is read.

    Over scalars a batch becomes a struct of arrays, which XLA fuses with what surrounds
    it; larger matrices go to the library's Cholesky factorisation.
    """
    n = len(right)
    if n > LARGEST_UNROLLED:
        lower = [[matrix[max(i, j)][min(i, j)] for j in range(n)] for i in range(n)]
        full = jnp.stack([jnp.stack(row) for row in lower])
        factor = jnp.linalg.cholesky(full)
        half = jnp.linalg.solve(factor, jnp.stack(right))
        return tuple(jnp.linalg.solve(factor.T, half))
    factor = [[None] * n for _ in range(n)]
    inverses: list = []  # of the pivots: multiplying costs a fraction of dividing
    for i in range(n):
        scaled = []
        for j in range(i):
            value = matrix[i][j]
            for k in range(j):
                value = value - scaled[k] * factor[j][k]
            scaled.append(value)
            factor[i][j] = value * inverses[j]
        pivot = matrix[i][i]
        for k in range(i):
            pivot = pivot - scaled[k] * factor[i][k]
        inverses.append(1 / pivot)
    x = list(right)
    for i in range(n):
        for k in range(i):
            x[i] = x[i] - factor[i][k] * x[k]
    x = [value * inverse for value, inverse in zip(x, inverses, strict=True)]
    for i in reversed(range(n)):
        for k in range(i + 1, n):
            x[i] = x[i] - factor[k][i] * x[k]
    return tuple(x)
