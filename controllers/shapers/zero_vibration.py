"""ZV, ZVD, ZVDD: no vibration of the mode, and flat about it to a rising order."""

import jax.numpy as jnp

from jaxflex import ScalarLike

from .shaper import Shaper, decaying, mode


def _binomial(frequency: ScalarLike, damping_ratio: ScalarLike, order: int) -> Shaper:
    rate, damped = mode(frequency, damping_ratio)
    weights = jnp.ones(1)
    for _ in range(order):
        weights = jnp.convolve(weights, jnp.full(2, 0.5))
    return decaying(weights, jnp.pi / damped * jnp.arange(order + 1.0), rate)


def zv(frequency: ScalarLike, damping_ratio: ScalarLike = 0.0) -> Shaper:
    """Zero vibration: two impulses half a damped period apart (Smith 1957; Singer and Seering 1990).

    `frequency` [Hz] is the undamped natural frequency of the mode.
    """
    return _binomial(frequency, damping_ratio, 1)


def zvd(frequency: ScalarLike, damping_ratio: ScalarLike = 0.0) -> Shaper:
    """Zero vibration and derivative: also flat in frequency at the mode (Singer and Seering 1990)."""
    return _binomial(frequency, damping_ratio, 2)


def zvdd(frequency: ScalarLike, damping_ratio: ScalarLike = 0.0) -> Shaper:
    """Zero vibration and two derivatives (Singer and Seering 1990)."""
    return _binomial(frequency, damping_ratio, 3)
