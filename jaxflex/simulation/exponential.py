"""Exponentials of `x' = A x + b(t)`, b a polynomial: for a whole interval as a matrix, or acting on a state.

    x(h) = e^(hA) x(0) + h sum_k k! phi_(k+1)(hA) c_k,    b(s h) = sum_k c_k s^k

with `phi_0(z) = e^z`, `phi_k(z) = (phi_(k-1)(z) - 1/(k-1)!) / z` (Hochbruck and Ostermann 2010,
section 2.1).
"""

import math

import equinox.internal as eqxi
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..scalars import Scalar

DEGREE = 5  # of the polynomials: that of the angle in a quintic move
TERMS = 15  # of the series of the last phi at a norm of one: the next is below rounding
REACH, REACH_TERMS = 8.0, 48  # norm of what a state is moved by in one go, and the series for it
BALANCING = 20
CHECKPOINTS = 16

Matrix = Float[Array, "n n"]


def phi(
    matrix: Matrix, lengths: Float[Array, " lengths"], backwards: bool
) -> Float[Array, "orders lengths n n"]:
    """`phi_0 … phi_(DEGREE+1)` of `length * matrix` for every length, by scaling and doubling.

    `backwards`: keep what reverse mode needs; without, forward mode alone works.
    """
    doublings = jnp.ceil(jnp.log2(jnp.maximum(size(matrix) * jnp.max(lengths), 1.0))).astype(int)
    z = lengths[:, None, None] * matrix * 0.5**doublings
    one = jnp.broadcast_to(jnp.eye(matrix.shape[0], dtype=matrix.dtype), z.shape)
    last = DEGREE + 1

    def horner(i, total):
        return one + z @ total / (last + TERMS - i)

    found = [jax.lax.fori_loop(0, TERMS, horner, one) / math.factorial(last)]
    for k in range(last, 0, -1):
        found.insert(0, z @ found[0] + one / math.factorial(k - 1))

    def doubled(_, phi):
        # phi_k(2z) = 2^-k (phi_0 phi_k + sum_j phi_j / (k-j)!), the j from 1 to k
        ahead = [phi[0] @ phi[k] for k in range(last + 1)]
        for k in range(1, last + 1):
            ahead[k] = sum((phi[j] / math.factorial(k - j) for j in range(1, k + 1)), ahead[k]) * 0.5**k
        return tuple(ahead)

    return jnp.stack(loop(doublings, doubled, tuple(found), backwards))


def moved(
    matrix: Matrix,
    state: Float[Array, "pieces n"],
    slopes: Float[Array, "pieces degrees n"],
    lengths: Float[Array, " pieces"],
    longest: Scalar,
    backwards: bool,
) -> Float[Array, "pieces n"]:
    """Each state after its length, under the input whose value and derivatives at its start are `slopes`.

    By Taylor series in short goes, as many for all as `longest` needs.
    """
    goes = jnp.ceil(jnp.maximum(size(matrix) * longest / REACH, 1.0)).astype(int)
    h = (lengths / goes)[:, None]

    orders = slopes.shape[1]

    def go(_, start):
        x, slopes = start
        total, term = x, x
        for m in range(orders):
            pushed = h ** (m + 1) / math.factorial(m + 1) * slopes[:, m]
            term = h / (m + 1) * (term @ matrix.T) + pushed
            total = total + term

        def more(m, carry):
            total, term = carry
            term = h / m * (term @ matrix.T)
            return total + term, term

        total, _ = jax.lax.fori_loop(orders + 1, REACH_TERMS, more, (total, term))
        further = [
            sum(h**j / math.factorial(j) * slopes[:, m + j] for j in range(orders - m)) for m in range(orders)
        ]
        return total, jnp.stack(further, axis=1) if orders else slopes

    return loop(goes, go, (state, slopes), backwards)[0]


def loop(count: Int[Array, ""], body, value, backwards: bool):
    """`body(i, value)` over and over, `count` times."""
    if not backwards:
        return jax.lax.fori_loop(0, count, body, value)
    _, value = eqxi.while_loop(
        lambda carry: carry[0] < count,
        lambda carry: (carry[0] + 1, body(*carry)),
        (jnp.zeros((), int), value),
        kind="checkpointed",
        checkpoints=CHECKPOINTS,
    )
    return value


def size(matrix: Matrix) -> Scalar:
    """Largest row sum: how much longer the matrix makes a vector, at most."""
    return jax.lax.stop_gradient(jnp.abs(matrix).sum(axis=1).max())


def balance(matrix: Matrix) -> Float[Array, " n"]:
    """Scales d for which rows and columns of `D^-1 A D` are of like size (Osborne 1960).

    An arm counts metres, metres a second and amperes: its matrix is larger than its
    fastest rate by three decades, all of which scaling and doubling would have to undo.
    """
    weights = jnp.abs(jax.lax.stop_gradient(matrix)) * (1 - jnp.eye(matrix.shape[0]))

    def improved(scale, _):
        now = weights * scale[None, :] / scale[:, None]
        rows, columns = now.sum(axis=1), now.sum(axis=0)
        some = (rows > 0) & (columns > 0)
        ratio = jnp.where(some, rows, 1.0) / jnp.where(some, columns, 1.0)
        return scale * ratio**0.25, None

    scale, _ = jax.lax.scan(improved, jnp.ones(matrix.shape[0]), None, length=BALANCING)
    return scale
