"""Algebraic Riccati equations, solved by SciPy and differentiated as equations.

At the stabilising solution the gain K is optimal, so a change of the data changes X only
through the linear (Lyapunov) equation of the closed loop `F = A - B K`:

- continuous: `F' dX + dX F + S = 0`
- sampled: `F' dX F - dX + S = 0`

with S what the change does to the cost at fixed X and K.
"""

import jax
import jax.numpy as jnp
import numpy as np
import scipy  # whose parts, imported when first used, take longer to import than all here
from jaxtyping import Array, Float

from jaxflex import Scalar

States = Float[Array, "states states"]
Into = Float[Array, "states inputs"]
Inputs = Float[Array, "inputs inputs"]


def _solved(name: str, library):
    def call(*matrices):
        try:
            return np.asarray(library()(*map(np.asarray, matrices)))
        except (np.linalg.LinAlgError, ValueError) as error:
            raise ValueError(
                f"{name}: no stabilising solution ({error}); every mode that does not decay by itself "
                "must be reached by an input and counted in the cost, and R must be positive definite."
            ) from error

    def solve(a, b, q, r):
        shape = jax.ShapeDtypeStruct(a.shape, a.dtype)
        return jax.pure_callback(call, shape, a, b, q, r, vmap_method="sequential")

    return solve


_continuous = _solved("solve_care", lambda: scipy.linalg.solve_continuous_are)
_sampled = _solved("solve_dare", lambda: scipy.linalg.solve_discrete_are)


@jax.custom_jvp
def solve_care(a: States, b: Into, q: States, r: Inputs) -> States:
    """X of `A'X + X A - X B R^-1 B'X + Q = 0`, the stabilising one.

    Works under `jit`, `vmap` (one after the other), `grad` and `jvp`. **Raises** where
    there is no such solution.
    """
    return _continuous(a, b, q, r)


@solve_care.defjvp
def _(primals, tangents):
    a, b, q, r = primals
    da, db, dq, dr = tangents
    x = solve_care(a, b, q, r)
    k = jnp.linalg.solve(r, b.T @ x)
    f, df = a - b @ k, da - db @ k
    s = df.T @ x + x @ df + dq + k.T @ dr @ k
    eye = jnp.eye(a.shape[0])
    return x, _linear(jnp.kron(f.T, eye) + jnp.kron(eye, f.T), s)


@jax.custom_jvp
def solve_dare(a: States, b: Into, q: States, r: Inputs) -> States:
    """X of `X = A'X A - A'X B (R + B'X B)^-1 B'X A + Q`, the stabilising one.

    Works under `jit`, `vmap` (one after the other), `grad` and `jvp`. **Raises** where
    there is no such solution.
    """
    return _sampled(a, b, q, r)


@solve_dare.defjvp
def _(primals, tangents):
    a, b, q, r = primals
    da, db, dq, dr = tangents
    x = solve_dare(a, b, q, r)
    k = jnp.linalg.solve(r + b.T @ x @ b, b.T @ x @ a)
    f, df = a - b @ k, da - db @ k
    s = df.T @ x @ f + f.T @ x @ df + dq + k.T @ dr @ k
    return x, _linear(jnp.kron(f.T, f.T) - jnp.eye(a.shape[0] ** 2), s)


def _linear(operator: Array, s: States) -> States:
    """DX of `operator dX + S = 0`, symmetric, rows of dX in a row."""
    x = -jnp.linalg.solve(operator, s.ravel()).reshape(s.shape)
    return (x + x.T) / 2


def lqr_gain(a: States, b: Into, q: States, r: Inputs, period: Scalar | None = None) -> Array:
    """K of `u = -K x` that minimises `int x'Q x + u'R u dt`, shape `(inputs, states)`.

    With a `period`, A and B are those of `x+ = A x + B u` and the integral is a sum.
    """
    if period is None:
        return jnp.linalg.solve(r, b.T @ solve_care(a, b, q, r))
    x = solve_dare(a, b, q, r)
    return jnp.linalg.solve(r + b.T @ x @ b, b.T @ x @ a)


def kalman_gain(a: States, c: Array, w: States, v: Array, period: Scalar | None = None) -> Array:
    """L of the observer `x^' = A x^ + B u + L (y - C x^)`, shape `(states, outputs)`.

    `w`, `v`: covariances of the noise on the states and on the outputs, white and of
    that intensity if continuous. With a `period` the observer is the predictor
    `x^+ = A x^ + B u + L (y - C x^)`. It is `lqr_gain` of the transposed system.
    """
    return lqr_gain(a.T, c.T, w, v, period).T
