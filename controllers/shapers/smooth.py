"""Smooth commands: kernels in place of impulses, with a zero of their spectrum on the mode.

A kernel is a shaper of many impulses: the nodes of a Gauss-Legendre rule, with its
weights times the kernel. The convolution with a smooth reference, and the residual of a
mode that turns by no more than some cycles over the kernel, are exact to rounding. With
damping the kernel is weighted with the decay of the mode, so that its zero stays on it.
"""

import jax.numpy as jnp
import numpy as np
import scipy  # whose parts, imported when first used, take longer to import than all here

from jaxflex import ScalarLike, scalar

from ..references import Move, SCurve
from .shaper import Shaper, decaying, mode

NODES = 24


def _kernel(values, cycles: float, frequency: ScalarLike, damping_ratio: ScalarLike) -> Shaper:
    """A kernel on [0, 1], given at the nodes, as long as `cycles` damped periods."""
    rate, damped = mode(frequency, damping_ratio)
    places, weights = np.polynomial.legendre.leggauss(NODES)
    share = weights * values((places + 1) / 2)
    # impulses of zero at both ends: the command starts at once, and its duration is the kernel's
    amplitudes = np.concatenate([[0.0], share / share.sum(), [0.0]])
    delays = np.concatenate([[0.0], (places + 1) / 2, [1.0]])
    length = 2 * jnp.pi * cycles / damped
    return decaying(jnp.asarray(amplitudes), length * jnp.asarray(delays), rate)


def polynomial(frequency: ScalarLike, damping_ratio: ScalarLike = 0.0, order: int = 1) -> Shaper:
    """The kernel `(x (1 - x))^order`, as short as cancels the mode at `frequency` [Hz].

    Its spectrum is the spherical Bessel function `j_order(pi f T)`, whose first zero is
    put on the mode: T is 1 period for order 0 (a moving average, which makes a ramp of a
    step), 1.43 for 1, 1.83 for 2 (which makes the quintic of `Quintic` of a step).
    """
    if order < 0:
        raise ValueError(f"order = {order}: at least 0 is allowed.")
    bessel = scipy.special.spherical_jn
    # the zeros of j_n and of j_(n-1) interlace, and the first is beyond n + 1
    low, high = order + 1.0, order + 1.0
    while bessel(order, low) * bessel(order, high) > 0:
        high += 0.5
    zero = float(scipy.optimize.brentq(lambda x: bessel(order, x), low, high, xtol=1e-14))  # pyright: ignore
    return _kernel(lambda x: (x * (1 - x)) ** order, zero / np.pi, frequency, damping_ratio)


def cosine(frequency: ScalarLike, damping_ratio: ScalarLike = 0.0) -> Shaper:
    """The kernel `1 - cos(2 pi x)`, two periods long, which makes a cycloid of a step.

    Its spectrum is zero at every multiple of half the frequency [Hz] from the mode on, so
    higher modes are damped as well: the price is twice the time of a moving average.
    """
    return _kernel(lambda x: 1 - np.cos(2 * np.pi * x), 2.0, frequency, damping_ratio)


def half_sine(frequency: ScalarLike, damping_ratio: ScalarLike = 0.0) -> Shaper:
    """The kernel `sin(pi x)`, one and a half periods long, which makes a half cosine wave of a step."""
    return _kernel(lambda x: np.sin(np.pi * x), 1.5, frequency, damping_ratio)


def matched_s_curve(start, stop, frequency: ScalarLike, shortest: ScalarLike = 0.0) -> Move:
    """An S-curve move [rad] whose spectrum has a zero on an undamped mode at `frequency` [Hz].

    The S-curve is a step through moving averages of a half, a quarter and a quarter of its
    duration: it leaves no vibration where the duration is an even number of periods. The
    smallest that is at least `shortest` [s] is taken.
    """
    period = 1 / scalar(frequency)
    cycles = jnp.maximum(2 * jnp.ceil(scalar(shortest) / (2 * period) - 1e-9), 2.0)
    return Move(start, stop, cycles * period, SCurve())
