"""How much vibration a shaper leaves, and how far off the mode may be."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxflex import Scalar, ScalarLike, one_off, scalar

from .roots import root_between
from .shaper import Shaper, mode

TOUCHING = 1e-6  # share of the tolerance by which a hump that just touches it may round above it
SEEN, SAMPLES = 2.0, 2001  # relative distance from the mode, and samples within it, of `insensitivity`


def residual_ratio(shaper: Shaper, frequency: ScalarLike, damping_ratio: ScalarLike = 0.0) -> Scalar:
    """Residual vibration of a mode with the shaper, as a share of that without.

    `exp(-zeta w t_n) |sum A_i exp((zeta w + j w_d) t_i)|` (Singer and Seering 1990), for
    an impulse each; exact for an under-damped mode. `frequency` [Hz].
    """
    rate, damped = mode(frequency, damping_ratio)
    growth = shaper.amplitudes * jnp.exp(rate * (shaper.delays - shaper.duration()))
    c = jnp.sum(growth * jnp.cos(damped * shaper.delays))
    s = jnp.sum(growth * jnp.sin(damped * shaper.delays))
    square = c**2 + s**2
    return jnp.where(square > 0, jnp.sqrt(jnp.where(square > 0, square, 1.0)), 0.0)


def residual_curve(
    shaper: Shaper, frequencies: Float[Array, " frequencies"], damping_ratio: ScalarLike = 0.0
) -> Float[Array, " frequencies"]:
    """`residual_ratio` at each of `frequencies` [Hz]: the insensitivity curve of a shaper."""
    return jax.vmap(lambda f: residual_ratio(shaper, f, damping_ratio))(frequencies)


def insensitivity(
    shaper: Shaper,
    frequency: ScalarLike,
    damping_ratio: ScalarLike = 0.0,
    tolerance: ScalarLike = 0.05,
) -> Scalar:
    """Width of the band about `frequency` [Hz] in which at most `tolerance` of the vibration is left.

    As a share of `frequency` (Singer and Seering 1990; Singhose, Seering and Singer
    1994). Zero where more than the tolerance is left at the frequency itself. The band
    is sought from zero to three times the frequency, and cut off there.
    """
    mode(frequency, damping_ratio)
    return _insensitivity(shaper, scalar(frequency), scalar(damping_ratio), scalar(tolerance))


@one_off
def _insensitivity(shaper: Shaper, frequency: Scalar, damping_ratio: Scalar, tolerance: Scalar) -> Scalar:
    def excess(ratio):
        return residual_ratio(shaper, frequency * ratio, damping_ratio) / (tolerance * (1 + TOUCHING)) - 1

    def edge(far):
        ratios = jnp.linspace(1.0, far, SAMPLES)
        beyond = jax.vmap(excess)(ratios) > 0
        first = jnp.argmax(beyond)
        crossing = root_between(excess, ratios[jnp.maximum(first - 1, 0)], ratios[first])
        return jnp.where(beyond[0], 1.0, jnp.where(beyond.any(), crossing, far))

    return edge(1 + SEEN) - edge(1e-3)
