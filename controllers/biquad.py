"""Second-order filters, continuous and sampled, and the notch."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Complex, Float

from jaxflex import Scalar, ScalarLike, scalar

Pair = tuple[Scalar, Scalar]


class Biquad(eqx.Module):
    """`(b2 p^2 + b1 p + b0) / (p^2 + a1 p + a0)`, with p = s [rad/s], or z if it has a `period` [s].

    **Fields**: `numerator` (b2, b1, b0), `denominator` (a1, a0), `period`. The state is
    that of the controllable form: `x1` moves towards `x2`, `x2` towards `u - a0 x1 - a1 x2`.
    """

    numerator: Float[Array, " 3"]
    denominator: Float[Array, " 2"]
    period: Scalar | None = None

    def output(self, state: Pair, u: Scalar) -> Scalar:
        """What comes out while `u` goes in."""
        (b2, b1, b0), (a1, a0) = self.numerator, self.denominator
        return (b0 - b2 * a0) * state[0] + (b1 - b2 * a1) * state[1] + b2 * u

    def _shifted(self, state: Pair, u: Scalar) -> Pair:
        a1, a0 = self.denominator
        return state[1], u - a0 * state[0] - a1 * state[1]

    def rate(self, state: Pair, u: Scalar) -> Pair:
        """Time derivative of the state of a continuous filter."""
        if self.period is not None:
            raise ValueError(
                "a sampled filter has no rate: simulate its controller with a period (ZeroOrderHold), "
                "or use the continuous filter."
            )
        return self._shifted(state, u)

    def advance(self, period: Scalar, state: Pair, u: Scalar) -> Pair:
        """State of a sampled filter one sample later."""
        if self.period is None:
            raise ValueError("a continuous filter under sampled control: give its `.sampled(period, …)`.")
        return self._shifted(state, u)

    def sampled(self, period: ScalarLike, exact_at: ScalarLike) -> "Biquad":
        """The same filter from sample to sample, by the bilinear transform, exact at one frequency [Hz].

        `s = c (z - 1)/(z + 1)`, with c such that `exact_at` keeps its place (Tustin with
        prewarping); `period` [s] must be below half of 1 / `exact_at`.
        """
        h, omega = scalar(period), 2 * jnp.pi * scalar(exact_at)
        c = omega / jnp.tan(omega * h / 2)
        squares = jnp.array([[1.0, -2.0, 1.0], [1.0, 0.0, -1.0], [1.0, 2.0, 1.0]])
        scale = jnp.stack([c**2, c, jnp.ones_like(c)])
        top = (self.numerator * scale) @ squares
        bottom = (jnp.append(1.0, self.denominator) * scale) @ squares
        return Biquad(top / bottom[0], bottom[1:] / bottom[0], h)

    def response(self, frequency: Float[Array, " frequencies"]) -> Complex[Array, " frequencies"]:
        """Gain at `frequency` [Hz]."""
        s = 2j * jnp.pi * frequency
        p = s if self.period is None else jnp.exp(s * self.period)
        return jnp.polyval(self.numerator, p) / jnp.polyval(jnp.append(1.0, self.denominator), p)


def notch(
    frequency: ScalarLike, width: ScalarLike = 1.0, depth: ScalarLike = 0.0, period: ScalarLike | None = None
) -> Biquad:
    """A notch at `frequency` [Hz]: `(s^2 + d w b s + w^2) / (s^2 + w b s + w^2)`.

    `width` b is that of the -3 dB band as a share of the frequency, `depth` d the gain
    at its middle. With a `period` [s] it is sampled, the notch kept in its place.
    """
    omega, b, d = 2 * jnp.pi * scalar(frequency), scalar(width), scalar(depth)
    one = jnp.ones_like(omega)
    continuous = Biquad(jnp.stack([one, d * omega * b, omega**2]), jnp.stack([omega * b, omega**2]))
    return continuous if period is None else continuous.sampled(period, frequency)
