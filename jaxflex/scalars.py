"""Scalars: the one type that every parameter of a model has."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

Scalar = Float[Array, ""]
ScalarLike = float | int | np.number | Float[Array, ""] | Int[Array, ""] | Float[np.ndarray, ""]


def scalar(value: ScalarLike) -> Scalar:
    """`value` as a strongly typed floating-point scalar of the precision in force.

    Python numbers become weakly typed arrays in JAX, and a weakly typed argument
    compiles a function anew; fixing the type here keeps one compilation for all.
    """
    return jnp.asarray(value, dtype=jnp.result_type(float))


def optional_scalar(value: ScalarLike | None) -> Scalar | None:
    """`scalar(value)`, or None where the value is absent."""
    return None if value is None else scalar(value)


def or_zero(value: ScalarLike | None) -> Scalar:
    """`scalar(value)`, zero where the value is absent."""
    return scalar(0.0 if value is None else value)


def dot(a: tuple, b: tuple) -> Scalar | float:
    """Sum of products of two tuples of scalars, in the form XLA fuses (no arrays)."""
    terms = [x * y for x, y in zip(a, b, strict=True)]
    return sum(terms[1:], terms[0]) if terms else 0.0
