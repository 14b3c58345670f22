"""SI: the shortest shaper that holds a tolerance over a band as wide as is asked for.

Singhose, Seering and Singer (1996) find it by a search over impulses with the residual
sampled in frequency. Without damping the search has an answer in equations. As the band
widens, the shaper takes turns between two forms:

- an EI shaper, slowed until the lower edge of its band is that of the band asked for;
- symmetric impulses of no fixed spacing, whose residual is at the tolerance at both
  edges and at the top of every hump between.

Where the humps of the EI shaper so slowed would not all fit into the band, the second is
the shorter.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array

from jaxflex import ScalarLike, scalar

from .extra_insensitive import chebyshev_impulses, ripple
from .shaper import Shaper, decaying, mode
from .zero_vibration import zv

WIDEST = 0.9


def si(
    frequency: ScalarLike,
    damping_ratio: ScalarLike = 0.0,
    insensitivity: float = 0.4,
    tolerance: float = 0.05,
) -> Shaper:
    """Specified insensitivity: at most `tolerance` is left from `frequency (1 -+ insensitivity / 2)`.

    `frequency` [Hz]. The number of impulses follows from `insensitivity` and
    `tolerance`, so these are plain numbers. The shortest such shaper of positive impulses
    where the mode is not damped. With damping each impulse is weighted with the decay of
    the mode, and less than the tolerance is left up to a damping ratio of 0.1.

    **Raises** `ValueError` for an insensitivity not within 0 and 0.9, or a tolerance not
    within 0.01 and 0.5.
    """
    if not 0 <= insensitivity <= WIDEST:
        raise ValueError(f"insensitivity = {insensitivity:g}: allowed is 0 to {WIDEST:g}.")
    if not 0.01 <= tolerance <= 0.5:
        raise ValueError(f"tolerance = {tolerance:g}: allowed is 0.01 to 0.5.")
    low, high = 1 - insensitivity / 2, 1 + insensitivity / 2
    if insensitivity / 2 <= 2 / np.pi * np.arcsin(tolerance):
        return zv(frequency, damping_ratio)
    rate, damped = mode(frequency, damping_ratio)
    humps, stretch, tops = 0, 0.0, np.zeros(0)
    while stretch * high > 2 - stretch * low or not humps:  # until the band of an EI shaper is wide enough
        humps += 1
        with jax.ensure_compile_time_eval():
            _, tops, edge = (np.asarray(part) for part in ripple(humps + 1, tolerance))
        stretch = float(edge) / low
    if tops[-1] <= stretch * high:
        amplitudes = chebyshev_impulses(humps + 1, scalar(tolerance))
        offsets = stretch / 2 * jnp.arange(humps + 2.0)
    else:
        amplitudes, offsets = _spread(humps, low, high, tolerance)
    return decaying(amplitudes, 2 * jnp.pi / damped * offsets, rate)


@eqx.filter_jit
def _spread(humps: int, low: float, high: float, tolerance: float) -> tuple[Array, Array]:
    """Amplitudes and delays [periods] of `humps + 2` impulses at the tolerance at both edges and between.

    About the middle the residual is `c + sum_k a_k cos(w tau_k)`, of alternating sign at
    the lower edge, at the tops and at the upper edge.
    """
    count = humps + 2
    pairs, even = count // 2, count % 2 == 0
    _, tops, edge = ripple(humps + 1, tolerance)
    stretch = edge / low
    spread = chebyshev_impulses(humps + 1, scalar(tolerance))[count - pairs :]
    start = {
        "pairs": 2 * (spread[:-1] if even else spread),
        "offsets": stretch / 2 * (jnp.arange(count - pairs, count) - (count - 1) / 2),
        "tops": tops[: humps - 1] / stretch,
    }

    def share(x, ratio):
        a, centre = x["pairs"], 1 - x["pairs"].sum()
        if even:
            a, centre = jnp.append(a, centre), 0.0
        return centre + jnp.sum(a * jnp.cos(2 * jnp.pi * ratio * x["offsets"]))

    def equations(x, _):
        where = jnp.concatenate([jnp.full(1, low), x["tops"], jnp.full(1, high)])
        signs = (-1.0) ** jnp.arange(humps + 1)
        heights = jax.vmap(lambda r: share(x, r))(where)
        slopes = jax.vmap(jax.grad(share, argnums=1), (None, 0))(x, x["tops"])
        return signs * heights / tolerance - 1, slopes

    x = optx.root_find(equations, optx.Newton(1e-12, 1e-12), start, throw=False, max_steps=60).value
    halves, last = x["pairs"] / 2, 1 - x["pairs"].sum()
    if even:
        halves = jnp.append(halves, last / 2)
        amplitudes = jnp.concatenate([halves[::-1], halves])
        offsets = jnp.concatenate([-x["offsets"][::-1], x["offsets"]])
    else:
        amplitudes = jnp.concatenate([halves[::-1], last[None], halves])
        offsets = jnp.concatenate([-x["offsets"][::-1], jnp.zeros(1), x["offsets"]])
    return amplitudes, offsets - offsets[0]
