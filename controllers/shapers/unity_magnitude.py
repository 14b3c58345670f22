"""UM: impulses of +1 and -1 in turn, the fastest shapers that a full drive can follow.

They are shorter than shapers of positive impulses, ask for twice their accelerations,
and may excite modes above the one they cancel.
"""

import equinox as eqx
import jax.numpy as jnp
import optimistix as optx
from jax.core import Tracer

from jaxflex import Scalar, ScalarLike, scalar

from .shaper import Shaper, mode

# delays as shares of the period without damping: exact, and rough
ZV_START = (1 / 6, 1 / 3)
ZVD_START = (0.09, 0.37, 0.64, 0.73)


def _alternating(frequency: ScalarLike, damping_ratio: ScalarLike, start: tuple[float, ...]) -> Shaper:
    mode(frequency, damping_ratio)
    shaper = _solved(scalar(frequency), scalar(damping_ratio), start)
    right = jnp.all(jnp.diff(shaper.delays) > 0) & (shaper.duration() * scalar(frequency) < 1)
    told = "no impulses of +1 and -1 cancel so damped a mode: damping_ratio up to 0.4 is allowed."
    if not isinstance(right, Tracer):
        if not right:
            raise ValueError(f"unity magnitude at damping_ratio = {scalar(damping_ratio):g}: {told}")
        return shaper
    return eqx.error_if(shaper, ~right, f"unity magnitude: {told}")


@eqx.filter_jit
def _solved(frequency: Scalar, damping_ratio: Scalar, start: tuple[float, ...]) -> Shaper:
    amplitudes = (-1.0) ** jnp.arange(len(start) + 1)
    rate, damped = mode(1.0, damping_ratio)

    def equations(delays, _):
        times = jnp.concatenate([jnp.zeros(1), delays])
        growth = amplitudes * jnp.exp(rate * times)
        waves = jnp.stack([jnp.cos(damped * times), jnp.sin(damped * times)])
        powers = times ** jnp.arange(len(start) // 2)[:, None]
        return jnp.einsum("i,wi,pi->wp", growth, waves, powers)

    first = jnp.asarray(start, dtype=jnp.result_type(float))
    delays = optx.root_find(equations, optx.Newton(1e-12, 1e-12), first, throw=False, max_steps=50).value
    return Shaper(amplitudes, jnp.concatenate([jnp.zeros(1), delays]) / frequency)


def um_zv(frequency: ScalarLike, damping_ratio: ScalarLike = 0.0) -> Shaper:
    """Unity magnitude, zero vibration: `+1, -1, +1` (Singhose, Singer and Seering 1994).

    Without damping at 0, 1/6 and 1/3 of the period; with it, the times solve the same
    equations by Newton's method.

    **Raises** `ValueError` for a damping ratio above 0.4 or so, where that finds none.
    """
    return _alternating(frequency, damping_ratio, ZV_START)


def um_zvd(frequency: ScalarLike, damping_ratio: ScalarLike = 0.0) -> Shaper:
    """Unity magnitude, zero vibration and derivative: five impulses (Singhose, Singer and Seering 1994).

    **Raises** `ValueError` as `um_zv` does.
    """
    return _alternating(frequency, damping_ratio, ZVD_START)
