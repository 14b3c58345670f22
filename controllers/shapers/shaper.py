"""A shaper is a train of impulses; a reference through it is a sum of delayed references.

`r_s(t) = sum_i A_i r(t - t_i)`, `sum A_i = 1`. The delayed references are evaluated
analytically, so that the result is smooth in the times t_i.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from jaxflex import AbstractReference, Scalar, ScalarLike, brief, scalar

Impulses = Float[Array, " impulses"]


class Shaper(eqx.Module):
    """A train of impulses: `amplitudes` A_i summing to one, `delays` t_i [s] from zero up.

    The free shaper is this class with amplitudes and delays left to `tune`.
    """

    amplitudes: Impulses
    delays: Impulses

    __repr__ = brief

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


def convolve(first: Shaper, second: Shaper) -> Shaper:
    """Both shapers in series: one impulse for every pair, for several modes at once."""
    delays = (first.delays[:, None] + second.delays[None, :]).ravel()
    amplitudes = (first.amplitudes[:, None] * second.amplitudes[None, :]).ravel()
    order = jnp.argsort(delays)
    return Shaper(amplitudes[order], delays[order])


def known(value: Scalar) -> bool:
    """True of a value that is there to look at, not traced by `jit` or `grad`."""
    return not isinstance(value, Tracer)


def mode(frequency: ScalarLike, damping_ratio: ScalarLike) -> tuple[Scalar, Scalar]:
    """Rate of decay `zeta w` and damped angular frequency `w sqrt(1 - zeta^2)`, both [rad/s].

    `frequency` [Hz] is the undamped natural frequency of the mode.

    **Raises** `ValueError` for a frequency or damping ratio out of range, where they are
    known when the function is called (not within `jit`).
    """
    f, zeta = scalar(frequency), scalar(damping_ratio)
    if known(f) and not 0 < np.asarray(f) < np.inf:
        raise ValueError(f"frequency = {f:g} Hz: a mode that can be shaped has a positive one.")
    if known(zeta) and not 0 <= np.asarray(zeta) < 1:
        raise ValueError(f"damping_ratio = {zeta:g}: allowed is at least 0 and below 1.")
    omega = 2 * jnp.pi * f
    return zeta * omega, omega * jnp.sqrt(1 - zeta**2)


def decaying(amplitudes: Impulses, delays: Impulses, rate: ScalarLike) -> Shaper:
    """The shaper of a mode that decays at `rate` [rad/s], from that of one that does not.

    Each impulse is weighted with `exp(-rate t_i)`, as much as the vibration left by the
    first has decayed by then: what cancels without damping cancels with it.
    """
    weights = amplitudes * jnp.exp(-scalar(rate) * delays)
    return Shaper(weights / weights.sum(), delays)
