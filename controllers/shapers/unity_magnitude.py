"""UM: impulses of +1 and -1 in turn, the fastest shapers that a full drive can follow.

They are shorter than shapers of positive impulses, ask for twice their accelerations,
and may excite modes above the one they cancel.
"""

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx

from jaxflex import Scalar, ScalarLike, one_off, scalar

from .shaper import Shaper, known, mode

MOST = 0.7  # damping ratio; beyond it the last impulses are upon each other
STEPS = 12  # in which the delays are followed from no damping on

# delays as shares of the period without damping: exact, and rough
ZV_START = (1 / 6, 1 / 3)
ZVD_START = (0.09, 0.37, 0.64, 0.73)


def _alternating(frequency: ScalarLike, damping_ratio: ScalarLike, start: tuple[float, ...]) -> Shaper:
    mode(frequency, damping_ratio)
    f, zeta = scalar(frequency), scalar(damping_ratio)
    if known(zeta) and np.asarray(zeta) > MOST:
        raise ValueError(f"damping_ratio = {zeta:g}: unity-magnitude shapers are for ratios up to {MOST:g}.")
    return _solved(f, zeta, start)


@one_off
def _solved(frequency: Scalar, damping_ratio: Scalar, start: tuple[float, ...]) -> Shaper:
    amplitudes = (-1.0) ** jnp.arange(len(start) + 1)

    def equations(delays, zeta):
        rate, damped = mode(1.0, zeta)
        times = jnp.concatenate([jnp.zeros(1), delays])
        growth = amplitudes * jnp.exp(rate * times)
        waves = jnp.stack([jnp.cos(damped * times), jnp.sin(damped * times)])
        powers = times ** jnp.arange(len(start) // 2)[:, None]
        return jnp.einsum("i,wi,pi->wp", growth, waves, powers)

    def follow(delays, share):
        solver = optx.Newton(1e-12, 1e-12)
        found = optx.root_find(equations, solver, delays, damping_ratio * share, throw=False, max_steps=50)
        return found.value, None

    first = jnp.asarray(start, dtype=jnp.result_type(float))
    delays, _ = jax.lax.scan(follow, first, jnp.linspace(0.0, 1.0, STEPS + 1))
    return Shaper(amplitudes, jnp.concatenate([jnp.zeros(1), delays]) / frequency)


def um_zv(frequency: ScalarLike, damping_ratio: ScalarLike = 0.0) -> Shaper:
    """Unity magnitude, zero vibration: `+1, -1, +1` (Singhose, Singer and Seering 1994).

    Without damping at 0, 1/6 and 1/3 of the period; with it, up to a ratio of 0.7, the times
    solve the same equations by Newton's method.
    """
    return _alternating(frequency, damping_ratio, ZV_START)


def um_zvd(frequency: ScalarLike, damping_ratio: ScalarLike = 0.0) -> Shaper:
    """Unity magnitude, zero vibration and derivative: five impulses (Singhose, Singer and Seering 1994)."""
    return _alternating(frequency, damping_ratio, ZVD_START)
