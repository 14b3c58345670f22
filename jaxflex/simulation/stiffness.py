"""How fast the fastest motion of a closed loop is, for the longest step an explicit solver may take."""

import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree

from ..scalars import Scalar
from .plant import Plant, State, derivative

ITERATIONS, COUNTED = 30, 20  # of the power iteration; the later ones are averaged


def fastest_rate(t: Scalar, state: State, plant: Plant) -> Scalar:
    """Estimate of the largest `|lambda|` [rad/s] of the loop linearised at `state`; zero if it has none.

    By power iteration: the geometric mean growth over many steps, which forgives that
    positions and rates are of different size and that complex poles make it swing. Slopes are
    differences, good enough for an estimate and compiled in half the time of derivatives.
    """
    flat, unflatten = ravel_pytree(state)

    def slope(x):
        return ravel_pytree(derivative(t, unflatten(x), plant))[0]

    flat = jax.lax.stop_gradient(flat)
    here, small = slope(flat), jnp.finfo(flat.dtype).eps ** 0.5

    def step(direction, _):
        new = (slope(flat + small * direction) - here) / small
        size = jnp.linalg.norm(new)
        return new / jnp.where(size > 0, size, 1.0), size

    begin = jnp.cos(1.0 + jnp.arange(flat.shape[0]))
    _, growth = jax.lax.scan(step, begin / jnp.linalg.norm(begin), None, length=ITERATIONS)
    counted = growth[-COUNTED:]
    alive = jnp.all(counted > 0)
    mean = jnp.exp(jnp.mean(jnp.log(jnp.where(alive, counted, 1.0))))
    return jax.lax.stop_gradient(jnp.where(alive, mean, 0.0))
