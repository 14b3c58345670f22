"""Rational transfer functions in the time domain: Heaviside's partial fractions."""

import jax.numpy as jnp
from jaxtyping import Array, Float


def step_response(
    numerator: Float[Array, " numerator"], denominator: Float[Array, " denominator"], t: Float[Array, "..."]
) -> Float[Array, "..."]:
    """Response at `t` [s] of `N(s) / D(s)` to a unit step, from rest.

    The inverse Laplace transform of `N(s) / (s D(s))`,
    `N(0)/D(0) + sum_p N(p) / (p D'(p)) exp(p t)` over the poles p. Coefficients are given
    highest power first; the poles must differ from each other and from zero, and D must
    be of higher degree than N.
    """
    poles = jnp.roots(denominator, strip_zeros=False)
    residues = jnp.polyval(numerator, poles) / (poles * jnp.polyval(jnp.polyder(denominator), poles))
    decay = jnp.sum(residues * jnp.exp(poles * t[..., None]), axis=-1)
    return numerator[-1] / denominator[-1] + decay.real
