"""How fast the fastest motion of a closed loop is, for the longest step an explicit solver may take."""

import equinox as eqx
import jax
import jax.numpy as jnp
import jax.tree_util as jtu
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
    # here and not at the end, so that nothing of it is ever differentiated
    t, state, plant = jtu.tree_map(
        lambda x: jax.lax.stop_gradient(x) if eqx.is_inexact_array(x) else x, (t, state, plant)
    )
    flat, unflatten = ravel_pytree(state)
    small = jnp.finfo(flat.dtype).eps ** 0.5
    begin = jnp.cos(1.0 + jnp.arange(flat.shape[0]))
    begin = unflatten(begin / jnp.linalg.norm(begin))

    def step(carry, number):
        # The first step, in no direction, finds the slope here, so that one program serves all. What
        # the slopes say is read a step later: read at once, XLA would compute them again for each reader.
        here, slope = carry
        first = number == 1
        here = jtu.tree_map(lambda h, s: jnp.where(first, s, h), here, slope)
        change = jtu.tree_map(lambda s, h: (s - h) / small, slope, here)
        size = jnp.sqrt(sum(jnp.sum(c**2) for c in jtu.tree_leaves(change)))
        scale = jnp.where(size > 0, size, 1.0)
        direction = jtu.tree_map(lambda b, c: jnp.where(first, b, c / scale), begin, change)
        slope = derivative(t, jtu.tree_map(lambda x, d: x + small * d, state, direction), plant)
        return (here, slope), size

    none = jtu.tree_map(jnp.zeros_like, state)
    _, growth = jax.lax.scan(step, (none, none), jnp.arange(ITERATIONS + 2))
    counted = growth[-COUNTED:]
    alive = jnp.all(counted > 0)
    mean = jnp.exp(jnp.mean(jnp.log(jnp.where(alive, counted, 1.0))))
    return jnp.where(alive, mean, 0.0)
