"""EI: a small vibration is let through everywhere in a band, so that the band can be wide.

Without damping, `n + 1` impulses half a period apart leave a share of the vibration that
is a polynomial of degree n in `cos(theta / 2)`, theta the phase of the mode over half a
period. The polynomial that is one at theta = 0, where nothing vibrates, and within
`+-tolerance` over the widest band is that of Chebyshev, as in the antenna arrays of
Dolph (1946). It gives the one-hump EI shaper of Singhose, Seering and Singer (1994) for
n = 2, the two- and three-hump shapers of Singhose, Porter, Tuttle and Singer (1997) for
n = 3 and 4, and ZV, ZVD, ZVDD as the tolerance goes to zero.
"""

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Float

from jaxflex import Scalar, ScalarLike, one_off, scalar

from .shaper import Shaper, decaying, known, mode

LEVELLED = 0.45  # damping ratio, times the number of impulses less one, up to which the humps are levelled


def chebyshev_impulses(degree: int, tolerance: Scalar) -> Float[Array, " impulses"]:
    """The `degree + 1` amplitudes whose ripple is `tolerance`: `v T_n(x_0 cos(theta/2))`, `v T_n(x_0) = 1`."""
    widest = _widest(degree, tolerance)
    k = jnp.arange(degree + 1)
    theta = 2 * jnp.pi * k / (degree + 1)
    x = widest * jnp.cos(theta / 2)
    before, value = jnp.ones_like(x), x
    for _ in range(degree - 1):
        before, value = value, 2 * x * value - before
    phase = jnp.outer(k - degree / 2, theta)
    return tolerance * jnp.mean(value * jnp.cos(phase), axis=1)


def _widest(degree: int, tolerance: Scalar) -> Scalar:
    return jnp.cosh(jnp.arccosh(1 / tolerance) / degree)


def ripple(degree: int, tolerance: ScalarLike) -> tuple[Array, Array, Scalar]:
    """Zeros, tops of the humps, and lower edge of the band, as multiples of the frequency, ascending."""
    widest = _widest(degree, scalar(tolerance))

    def ratio(x):
        return 2 / jnp.pi * jnp.arccos(x / widest)

    zeros = jnp.cos(jnp.pi * (jnp.arange(degree) + 0.5) / degree)
    humps = jnp.cos(jnp.pi * jnp.arange(1, degree) / degree)
    return ratio(zeros), ratio(humps), ratio(1.0)


def ei(
    frequency: ScalarLike,
    damping_ratio: ScalarLike = 0.0,
    tolerance: ScalarLike = 0.05,
    humps: int = 1,
) -> Shaper:
    """Extra-insensitive with any number of `humps` (Singhose et al. 1994, 1997).

    Over a band about `frequency` [Hz] at most the share `tolerance` of the vibration is
    left; between its zeros the share rises to just that, once for every hump. With
    damping, amplitudes and times solve these equations at the given damping ratio up to
    a ratio of `0.45 / (humps + 1)`. Beyond that the outer humps fade into the slope;
    there each impulse is weighted with the decay of the mode, which levels the humps of
    modes of equal decay.

    **Raises** `ValueError` for no humps, or a tolerance that is known and not within 0 and 1.
    """
    if humps < 1:
        raise ValueError(f"humps = {humps}: at least 1 is allowed.")
    share = scalar(tolerance)
    if known(share) and not 0 < np.asarray(share) < 1:
        raise ValueError(f"tolerance = {share:g}: allowed is more than 0 and less than 1.")
    mode(frequency, damping_ratio)
    return _ei(scalar(frequency), scalar(damping_ratio), share, humps)


@one_off
def _ei(frequency: Scalar, zeta: Scalar, tolerance: Scalar, humps: int) -> Shaper:
    limit = LEVELLED / (humps + 1)
    rough = _weighted(zeta, tolerance, humps)[0]
    fine = _levelled(jnp.minimum(zeta, limit), tolerance, humps)
    pick = zeta <= limit
    return Shaper(
        jnp.where(pick, fine.amplitudes, rough.amplitudes),
        jnp.where(pick, fine.delays, rough.delays) / frequency,
    )


def _weighted(zeta: Scalar, tolerance: Scalar, humps: int) -> tuple[Shaper, Scalar]:
    """Chebyshev's impulses for 1 Hz with the decay of the mode, and the ripple they have without it."""
    degree = humps + 1
    rate, damped = mode(1.0, zeta)
    delays = jnp.pi / damped * jnp.arange(degree + 1.0)
    growth = jnp.exp(rate * (delays[-1] - delays))
    allowed = tolerance
    for _ in range(8):  # the decay makes the ripple smaller, so a larger one may be allowed
        share = jnp.sum(growth * chebyshev_impulses(degree, allowed))
        allowed = jnp.minimum(tolerance * share, 0.999)
    return decaying(chebyshev_impulses(degree, allowed), delays, rate), allowed


def _levelled(zeta: Scalar, tolerance: Scalar, humps: int) -> Shaper:
    """Impulses for 1 Hz whose residual has its zeros and, between them, tops at `tolerance`."""
    rough, allowed = _weighted(zeta, tolerance, humps)
    zeros, tops, _ = ripple(humps + 1, allowed)
    middle = humps // 2
    odd = humps % 2 == 1  # the mode is at the top of the middle hump, else at the middle zero

    def impulses(x):
        amplitudes = jnp.append(x["amplitudes"], 1 - x["amplitudes"].sum())
        return Shaper(amplitudes, jnp.concatenate([jnp.zeros(1), x["delays"]]))

    def phasor(shaper, ratio):
        rate, damped = mode(ratio, zeta)
        growth = shaper.amplitudes * jnp.exp(rate * (shaper.delays - shaper.duration()))
        return jnp.sum(growth * jnp.cos(damped * shaper.delays)), jnp.sum(
            growth * jnp.sin(damped * shaper.delays)
        )

    def equations(x, _):
        shaper = impulses(x)
        at = x["zeros"] if odd else jnp.append(x["zeros"], 1.0)
        on = jnp.append(x["tops"], 1.0) if odd else x["tops"]

        def square(ratio):
            c, s = phasor(shaper, ratio)
            return (c**2 + s**2) / tolerance**2

        height, slope = jax.vmap(jax.value_and_grad(square))(on)
        return jax.vmap(lambda ratio: phasor(shaper, ratio))(at), height - 1, slope

    start = {
        "amplitudes": rough.amplitudes[:-1],
        "delays": rough.delays[1:],
        "zeros": zeros if odd else jnp.delete(zeros, middle),
        "tops": jnp.delete(tops, middle) if odd else tops,
    }
    start = jax.tree_util.tree_map(jax.lax.stop_gradient, start)
    found = optx.root_find(equations, optx.Newton(1e-12, 1e-12), start, throw=False, max_steps=30)
    return impulses(found.value)
