"""`K v = lambda M v` turned into the eigenproblem of one symmetric matrix."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

Square = Float[Array, "n n"]


def whiten(mass: Square, stiffness: Square) -> tuple[Square, Square]:
    """Factor L of `M = L L^T`, and `L^-1 K L^-T`, which has the eigenvalues of the pair."""
    factor = jnp.linalg.cholesky(mass)
    half = jax.scipy.linalg.solve_triangular(factor, stiffness, lower=True)
    whitened = jax.scipy.linalg.solve_triangular(factor, half.T, lower=True)
    return factor, (whitened + whitened.T) / 2
