"""The best shaper on a grid of times for a linear loop: a linear program, solved to the end."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.optimize import linprog

import controllers as ctl

DIRECTIONS = 33  # tangents to the quarter circle: the diagonal of a box is met to 0.03 %, from below


class Optimum(NamedTuple):
    """`amplitudes` at the `delays` [s] of a grid, and `worst`, the least worst residual [m]."""

    worst: float
    delays: np.ndarray
    amplitudes: np.ndarray

    def impulses(self) -> list[tuple[float, float]]:
        """Delay [s] and amplitude of every impulse that is there."""
        there = self.amplitudes > 1e-4
        return [(float(t), float(a)) for t, a in zip(self.delays[there], self.amplitudes[there], strict=True)]


def responses(
    motions: ctl.FreeMotion, duration: float, times: Float[Array, " times"], delays: np.ndarray
) -> np.ndarray:
    """Tip [m] of every payload for one impulse at each delay: `(payloads, delays, times, 2)`."""

    def of(motion, delay):
        one = ctl.Shaper(jnp.array([1.0, 0.0]), jnp.stack([delay, jnp.asarray(duration)]))
        return ctl.tip_after(motion, one, times)

    over_delays = jax.vmap(of, in_axes=(None, 0))
    return np.asarray(jax.jit(jax.vmap(over_delays, in_axes=(0, None)))(motions, jnp.asarray(delays)))


def optimum(motions: ctl.FreeMotion, duration: float, times: Float[Array, " times"], points: int) -> Optimum:
    """Nonnegative amplitudes on `points` delays that sum to one, with the least worst residual.

    The tip is linear in the amplitudes A. For every payload and axis, `h >= y_t(A)` and
    `l >= -y_t(A)` at every instant t, `h, l >= 0`, bound its box, and `w >= (h_x + l_x)
    cos(a) + (h_y + l_y) sin(a)` at every angle a of a quarter circle bounds the diagonal:
    the least w is a lower bound of the residual that any shaper on the grid leaves.
    """
    delays = np.linspace(0.0, duration, points)
    paths = responses(motions, duration, times, delays)
    scale = np.abs(paths).max()
    payloads, _, count, axes = paths.shape
    sizes = points + 2 * axes * payloads + 1  # A, then h and l by payload and axis, then w
    rows = []
    for p in range(payloads):
        sides = []
        for axis in range(axes):
            wave = paths[p, :, :, axis].T / scale
            high = points + 2 * (p * axes + axis)
            for column, sign in ((high, 1.0), (high + 1, -1.0)):
                block = np.zeros((count, sizes))
                block[:, :points] = sign * wave
                block[:, column] = -1.0
                rows.append(block)
            sides.append([high, high + 1])
        angles = np.linspace(0.0, np.pi / 2, DIRECTIONS)
        block = np.zeros((DIRECTIONS, sizes))
        block[:, sides[0]] = np.cos(angles)[:, None]
        block[:, sides[1]] = np.sin(angles)[:, None]
        block[:, -1] = -1.0
        rows.append(block)
    bounds = np.vstack(rows)
    cost, whole = np.zeros(sizes), np.zeros((1, sizes))
    cost[-1], whole[0, :points] = 1.0, 1.0
    found = linprog(cost, bounds, np.zeros(len(bounds)), whole, [1.0], method="highs")
    if found.status != 0:
        raise RuntimeError(f"the linear program was not solved: {found.message}")
    return Optimum(scale * found.x[-1], delays, found.x[:points])
