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

from functools import lru_cache

import jax
import jax.numpy as jnp
import numpy as np
import scipy  # whose parts, imported when first used, take longer to import than all here

from jaxflex import ScalarLike, scalar

from .extra_insensitive import chebyshev_impulses, ripple
from .shaper import Shaper, decaying, mode
from .zero_vibration import zv

WIDEST = 0.9
STEPS = 24  # in which a solution is followed


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
    the mode; it then is on the safe side, and no longer the shortest: of 5 % allowed it
    leaves 4 % at a damping ratio of 0.1 and 2 to 3 % at 0.3.

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
        amplitudes, offsets = map(jnp.asarray, _spread(humps, float(insensitivity), float(tolerance)))
    return decaying(amplitudes, 2 * jnp.pi / damped * offsets, rate)


@lru_cache
def _spread(humps: int, width: float, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Amplitudes and delays [periods] of `humps + 2` impulses at the tolerance at both edges and between.

    About the middle the residual is `c + sum_k a_k cos(w tau_k)`, of alternating sign at
    the lower edge, at the tops and at the upper edge. At some width the slowed EI shaper
    is one of these; from there the solution is followed down to the width asked for.
    """
    count = humps + 2
    pairs, even = count // 2, count % 2 == 0
    with jax.ensure_compile_time_eval():
        _, tops, edge = (np.asarray(part) for part in ripple(humps + 1, tolerance))
        spread = np.asarray(chebyshev_impulses(humps + 1, scalar(tolerance)))[count - pairs :]
    common = 2 * (tops[-1] - edge) / (tops[-1] + edge)
    stretch = edge / (1 - common / 2)
    offsets = stretch / 2 * (np.arange(count - pairs, count) - (count - 1) / 2)
    signs = (-1.0) ** np.arange(humps + 1)
    free = pairs - 1 if even else pairs

    def parts(x):
        a, squares, inner = x[:free], x[free : free + pairs], x[free + pairs :]
        rest = 1 - a.sum()
        return (np.append(a, rest), 0.0, squares, inner) if even else (a, rest, squares, inner)

    def equations(x, low, high):
        a, centre, squares, inner = parts(x)
        where = np.concatenate([[low], inner, [high]])
        # the inner two impulses meet at the narrow end: their offset enters by its square
        angles = 2 * np.pi * np.outer(where, np.sqrt(squares + 0j))
        heights = centre + np.real(np.cos(angles)) @ a
        slopes = np.real(np.sin(angles[1:-1]) * np.sqrt(squares + 0j)) @ a
        return np.concatenate([signs * heights / tolerance - 1, slopes / tolerance])

    x = np.concatenate([2 * spread[:free], offsets**2, tops[: humps - 1] / stretch])
    for near in np.linspace(common, width, STEPS):
        x = scipy.optimize.root(equations, x, (1 - near / 2, 1 + near / 2), tol=1e-13).x
    error = np.abs(equations(x, 1 - width / 2, 1 + width / 2)).max()
    a, centre, squares, _ = parts(x)
    if not error < 1e-8 or squares.min() < 0:
        raise ValueError(f"insensitivity = {width:g}: its equations were not solved; try a width next to it.")
    halves, taus = a / 2, np.sqrt(squares)
    middle = np.zeros(0) if even else np.array([centre])
    amplitudes = np.concatenate([halves[::-1], middle, halves])
    delays = np.concatenate([-taus[::-1], 0 * middle, taus]) + taus[-1]
    return amplitudes, delays
