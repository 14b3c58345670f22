"""Input shapers: impulses that, convolved with a reference, leave a mode at rest.

A shaper wraps a reference: `r_s(t) = sum_i A_i r(t - t_i)`, `sum A_i = 1`. The delayed
references are evaluated analytically, so that the result is smooth in the times t_i.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxflex import AbstractReference, Scalar, ScalarLike, scalar

Impulses = Float[Array, " impulses"]


class Shaper(eqx.Module):
    """A train of impulses: `amplitudes` A_i summing to one, `delays` t_i [s] from zero up.

    The free shaper is this class with amplitudes and delays left to `tune`.
    """

    amplitudes: Impulses
    delays: Impulses

    def duration(self) -> Scalar:
        """Time [s] by which the shaper lengthens a move."""
        return self.delays[-1]

    def padded(self, impulses: int) -> "Shaper":
        """The same shaper with impulses of zero amplitude added at its end, to `impulses` in all."""
        extra = impulses - self.delays.shape[0]
        if extra < 0:
            raise ValueError(f"the shaper has {self.delays.shape[0]} impulses, more than {impulses}.")
        return Shaper(
            jnp.append(self.amplitudes, jnp.zeros(extra)),
            jnp.append(self.delays, jnp.full(extra, self.delays[-1])),
        )


class Shaped(AbstractReference):
    """`reference` through `shaper`."""

    reference: AbstractReference
    shaper: Shaper

    def __call__(self, t: Scalar) -> tuple[Scalar, ...]:
        """Value of every joint at `t` [s]."""
        total = None
        for i in range(self.shaper.delays.shape[0]):
            amplitude = self.shaper.amplitudes[i]
            part = tuple(amplitude * v for v in self.reference(t - self.shaper.delays[i]))
            total = part if total is None else tuple(map(jnp.add, total, part))
        assert total is not None
        return total

    def jumps(self) -> Float[Array, " jumps"]:
        """The jumps of the reference, delayed by every impulse [s]."""
        return (self.reference.jumps()[None, :] + self.shaper.delays[:, None]).ravel()

    def end(self) -> Scalar:
        """End of the reference plus the last delay [s]."""
        return self.reference.end() + self.shaper.duration()


def unshaped() -> Shaper:
    """One impulse: the reference as it is."""
    return Shaper(jnp.ones(1), jnp.zeros(1))


def _mode(frequency: ScalarLike, damping_ratio: ScalarLike) -> tuple[Scalar, Scalar]:
    """Damped half period [s] and the ratio `K` by which a half period shrinks the vibration."""
    zeta = scalar(damping_ratio)
    root = jnp.sqrt(1 - zeta**2)
    half_period = 0.5 / (scalar(frequency) * root)
    return half_period, jnp.exp(-zeta * jnp.pi / root)


def _binomial(frequency: ScalarLike, damping_ratio: ScalarLike, order: int) -> Shaper:
    half_period, k = _mode(frequency, damping_ratio)
    weights = jnp.ones(1)
    for _ in range(order):
        weights = jnp.convolve(weights, jnp.stack([jnp.ones_like(k), k]))
    return Shaper(weights / weights.sum(), half_period * jnp.arange(order + 1.0))


def zv(frequency: ScalarLike, damping_ratio: ScalarLike = 0.0) -> Shaper:
    """Zero vibration: two impulses half a damped period apart (Smith 1957; Singer and Seering 1990).

    `frequency` [Hz] is the undamped natural frequency of the mode.
    """
    return _binomial(frequency, damping_ratio, 1)


def zvd(frequency: ScalarLike, damping_ratio: ScalarLike = 0.0) -> Shaper:
    """Zero vibration and derivative: also flat in frequency at the mode (Singer and Seering 1990)."""
    return _binomial(frequency, damping_ratio, 2)


def zvdd(frequency: ScalarLike, damping_ratio: ScalarLike = 0.0) -> Shaper:
    """Zero vibration and two derivatives (Singer and Seering 1990)."""
    return _binomial(frequency, damping_ratio, 3)


def ei(frequency: ScalarLike, damping_ratio: ScalarLike = 0.0, tolerance: ScalarLike = 0.05) -> Shaper:
    """Extra-insensitive, one hump (Singhose, Seering and Singer 1994).

    At the mode itself the share `tolerance` of the vibration is left, and in return none
    at two frequencies about it. Undamped: amplitudes (1+v)/4, (1-v)/2, (1+v)/4 half a
    period apart, v the tolerance. With damping each impulse is weighted with the decay
    of the mode, as in the damped ZV, and v is chosen so that the share left at the mode
    is again `tolerance` (at most 1, reached when the mode all but dies within a period).
    """
    half_period, k = _mode(frequency, damping_ratio)
    tol = scalar(tolerance)
    room = k**2 - tol * (1 - k) ** 2 / 4
    v = jnp.where(room > 0, tol * (1 + k) ** 2 / 4 / jnp.where(room > 0, room, 1.0), 1.0)
    v = jnp.minimum(v, 1.0)
    weights = jnp.stack([(1 + v) / 4, (1 - v) / 2 * k, (1 + v) / 4 * k**2])
    return Shaper(weights / weights.sum(), half_period * jnp.arange(3.0))


def convolve(first: Shaper, second: Shaper) -> Shaper:
    """Both shapers in series: one impulse for every pair, for several modes at once."""
    delays = (first.delays[:, None] + second.delays[None, :]).ravel()
    amplitudes = (first.amplitudes[:, None] * second.amplitudes[None, :]).ravel()
    order = jnp.argsort(delays)
    return Shaper(amplitudes[order], delays[order])


CLASSICAL = {"ZV": zv, "ZVD": zvd, "ZVDD": zvdd, "EI": ei}


def residual_ratio(shaper: Shaper, frequency: ScalarLike, damping_ratio: ScalarLike = 0.0) -> Scalar:
    """Residual vibration of a mode with the shaper, as a share of that without.

    `exp(-zeta w t_n) |sum A_i exp((zeta w + j w_d) t_i)|` (Singer and Seering 1990), for
    an impulse each; `frequency` [Hz].
    """
    zeta = scalar(damping_ratio)
    omega = 2 * jnp.pi * scalar(frequency)
    damped = omega * jnp.sqrt(1 - zeta**2)
    growth = shaper.amplitudes * jnp.exp(zeta * omega * (shaper.delays - shaper.duration()))
    c = jnp.sum(growth * jnp.cos(damped * shaper.delays))
    s = jnp.sum(growth * jnp.sin(damped * shaper.delays))
    return jnp.hypot(c, s)
