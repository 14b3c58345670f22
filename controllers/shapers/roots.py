"""Where a smooth function of one variable crosses zero, with the derivative of the crossing."""

from collections.abc import Callable

import jax
import jax.numpy as jnp

from jaxflex import Scalar

HALVINGS = 60


def root_between(function: Callable[[Scalar], Scalar], low: Scalar, high: Scalar) -> Scalar:
    """The root of `function` between `low` and `high`, at which its signs differ, by bisection.

    A last Newton step has the derivative of the implicit function theorem. Where the
    signs do not differ the result is a finite number near one of the ends.
    """
    low, high = jax.lax.stop_gradient((low, high))

    def halve(_, ends):
        low, high = ends
        middle = (low + high) / 2
        same = (function(middle) > 0) == (function(low) > 0)
        return jnp.where(same, middle, low), jnp.where(same, high, middle)

    low, high = jax.lax.stop_gradient(jax.lax.fori_loop(0, HALVINGS, halve, (low, high)))
    value, slope = jax.value_and_grad(function)(low)
    slope = jax.lax.stop_gradient(slope)
    step = jnp.where(slope == 0, 0.0, value / jnp.where(slope == 0, 1.0, slope))
    # rounding leaves the step within the last interval; only its derivative matters
    return low - (step - jax.lax.stop_gradient(step))
