"""Several modes at once. `convolve` puts shapers in series; here all modes are designed for together."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxflex import ScalarLike, one_off, scalar

from .roots import root_between
from .shaper import Shaper, mode

Modes = Float[Array, " modes"]
SAMPLES = 2000  # spacings tried


def zero_placement(frequencies: Modes, damping_ratios: Modes, spacing: ScalarLike) -> Shaper:
    """Impulses `spacing` [s] apart with a zero on the poles of every mode (Tuttle and Seering 1994).

    The amplitudes are the coefficients of `prod_k (1 - 2 e^(-sigma h) cos(w_d h) z + e^(-2 sigma h) z^2)`,
    scaled to sum to one: `2 modes + 1` of them. They may be negative where the spacing is
    short, or several modes ask for different ones. A mode given twice is cancelled with
    its derivative.
    """
    h = scalar(spacing)
    weights = jnp.ones(1)
    for k in range(frequencies.shape[0]):
        rate, damped = mode(frequencies[k], damping_ratios[k])
        shrink = jnp.exp(-rate * h)
        once, twice = -2 * shrink * jnp.cos(damped * h), shrink**2
        longer = jnp.pad(weights, (0, 2))
        weights = longer + once * jnp.roll(longer, 1) + twice * jnp.roll(longer, 2)
    return Shaper(weights / weights.sum(), h * jnp.arange(weights.shape[0]))


@one_off
def simultaneous(frequencies: Modes, damping_ratios: Modes) -> Shaper:
    """Zero placement at the shortest spacing at which no amplitude is negative.

    For two modes below three times apart in frequency it is shorter than two ZV in series,
    by up to a quarter; up to four times apart it is no longer to within a hundredth, and
    beyond that one spacing does not suit both, and ZV in series are shorter. Without
    damping and below three times it is three impulses `1 / (f_1 + f_2)` apart, the fewest there can be (Hyde and
    Seering 1991; Pao 1999), with impulses of zero between; for one mode it is ZV.
    Spacings up to the longest period are looked at; if none will do, the one with the
    smallest negative amplitude is taken.
    """
    longest = 1 / jnp.min(frequencies)

    def least(spacing):
        return jnp.min(zero_placement(frequencies, damping_ratios, spacing).amplitudes)

    spacings = jax.lax.stop_gradient(longest) * jnp.arange(1.0, SAMPLES + 1) / SAMPLES
    # the sum of all weights vanishes with the spacing, which makes amplitudes of any size
    values = jax.vmap(least)(spacings)
    good = values >= 0
    first = jnp.maximum(jnp.argmax(good), 1)
    edge = root_between(least, spacings[first - 1], spacings[first])
    return zero_placement(
        frequencies, damping_ratios, jnp.where(good.any(), edge, spacings[jnp.argmax(values)])
    )
