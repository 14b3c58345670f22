"""References: where the joints should be, as functions of time.

A point-to-point `Move` is a profile that runs from 0 to 1, times the distance. Profiles
are analytic, so that gradients with respect to distance, duration and delay are exact.
"""

from abc import abstractmethod
from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxflex import AbstractReference, Scalar, ScalarLike, scalar


def scalars(values: ScalarLike | Sequence[ScalarLike]) -> tuple[Scalar, ...]:
    """A tuple of scalars from a number or a sequence of them, one a joint."""
    if isinstance(values, (tuple, list)):
        return tuple(scalar(v) for v in values)
    array = jnp.asarray(values, dtype=jnp.result_type(float))
    return tuple(scalar(v) for v in jnp.atleast_1d(array))


class AbstractProfile(eqx.Module):
    """A course from 0 to 1 over normalised time."""

    @abstractmethod
    def __call__(self, tau: Scalar) -> Scalar:
        """Share of the distance covered at `tau` in [0, 1]."""

    @abstractmethod
    def knots(self) -> tuple[Scalar, ...]:
        """Normalised times at which a derivative jumps, 0 and 1 included."""


class Quintic(AbstractProfile):
    """`10 tau^3 - 15 tau^4 + 6 tau^5`: rate and acceleration vanish at both ends.

    The move of least integrated squared jerk between two rests (Flash and Hogan 1985).
    """

    def __call__(self, tau: Scalar) -> Scalar:
        """Share of the distance covered at `tau`."""
        return tau**3 * (10 + tau * (6 * tau - 15))

    def knots(self) -> tuple[Scalar, ...]:
        """Both ends."""
        return scalar(0.0), scalar(1.0)


MinimumJerk = Quintic


class Trapezoid(AbstractProfile):
    """Trapezoidal rate: constant acceleration over the share `ramp` of the time at either end.

    `ramp = 0.5` is a bang-bang acceleration, the fastest move under an acceleration limit.
    """

    ramp: Scalar = eqx.field(converter=scalar, default=0.25)

    def __call__(self, tau: Scalar) -> Scalar:
        """Share of the distance covered at `tau`."""
        top = 1 / (1 - self.ramp)
        rise = top * tau**2 / (2 * self.ramp)
        cruise = top * (tau - self.ramp / 2)
        fall = 1 - top * (1 - tau) ** 2 / (2 * self.ramp)
        return jnp.where(tau < self.ramp, rise, jnp.where(tau <= 1 - self.ramp, cruise, fall))

    def knots(self) -> tuple[Scalar, ...]:
        """Both ends, and the ends of the ramps."""
        return scalar(0.0), self.ramp, 1 - self.ramp, scalar(1.0)


class SCurve(AbstractProfile):
    """Piecewise constant jerk in four equal parts: `+j, -j, -j, +j`, no cruise."""

    def __call__(self, tau: Scalar) -> Scalar:
        """Share of the distance covered at `tau`."""
        near = jnp.minimum(tau, 1 - tau)  # the course is symmetric about its middle
        first = 16 / 3 * near**3
        x = near - 0.25
        second = 1 / 12 + x + 4 * x**2 - 16 / 3 * x**3
        half = jnp.where(near < 0.25, first, second)
        return jnp.where(tau <= 0.5, half, 1 - half)

    def knots(self) -> tuple[Scalar, ...]:
        """The ends of the four parts."""
        return tuple(scalar(k / 4) for k in range(5))


class Move(AbstractReference):
    """A synchronised move of all joints from `start` to `stop` [rad] in `duration` [s].

    Begins at `begin` [s]; the course is that of `profile`.
    """

    start: tuple[Scalar, ...] = eqx.field(converter=scalars)
    stop: tuple[Scalar, ...] = eqx.field(converter=scalars)
    duration: Scalar = eqx.field(converter=scalar)
    profile: AbstractProfile = Quintic()
    begin: Scalar = eqx.field(converter=scalar, default=0.0)

    def __check_init__(self):
        if len(self.start) != len(self.stop):
            raise ValueError(
                f"Move: start has {len(self.start)} joint(s), stop has {len(self.stop)}; they must be equal."
            )

    def __call__(self, t: Scalar) -> tuple[Scalar, ...]:
        """Angle of every joint [rad] at `t` [s]."""
        tau = jnp.clip((t - self.begin) / self.duration, 0.0, 1.0)
        share = self.profile(tau)
        return tuple(a + (b - a) * share for a, b in zip(self.start, self.stop, strict=True))

    def jumps(self) -> Float[Array, " jumps"]:
        """The knots of the profile [s]."""
        return self.begin + self.duration * jnp.stack(self.profile.knots())

    def end(self) -> Scalar:
        """`begin + duration` [s]."""
        return self.begin + self.duration


class Step(AbstractReference):
    """A jump of all joints from `start` to `stop` [rad] at `begin` [s]."""

    start: tuple[Scalar, ...] = eqx.field(converter=scalars)
    stop: tuple[Scalar, ...] = eqx.field(converter=scalars)
    begin: Scalar = eqx.field(converter=scalar, default=0.0)

    def __call__(self, t: Scalar) -> tuple[Scalar, ...]:
        """Value for every joint at `t` [s]."""
        after = t >= self.begin
        return tuple(jnp.where(after, b, a) for a, b in zip(self.start, self.stop, strict=True))

    def jumps(self) -> Float[Array, " jumps"]:
        """The instant of the step [s]."""
        return self.begin[None]

    def end(self) -> Scalar:
        """The instant of the step [s]."""
        return self.begin


class BangBang(AbstractReference):
    """`+amplitude` for `width` [s], then `-amplitude` for as long, then zero (Ahmad et al., section IV).

    A profile of torque, current or voltage for `OpenLoop`, one amplitude a joint.
    """

    amplitude: tuple[Scalar, ...] = eqx.field(converter=scalars)
    width: Scalar = eqx.field(converter=scalar, default=1.0)
    begin: Scalar = eqx.field(converter=scalar, default=0.0)

    def __call__(self, t: Scalar) -> tuple[Scalar, ...]:
        """Value for every joint at `t` [s]."""
        since = (t - self.begin) / self.width
        sign = jnp.where((since >= 0) & (since < 1), 1.0, jnp.where((since >= 1) & (since < 2), -1.0, 0.0))
        return tuple(a * sign for a in self.amplitude)

    def jumps(self) -> Float[Array, " jumps"]:
        """Start, reversal and end [s]."""
        return self.begin + self.width * jnp.arange(3.0)

    def end(self) -> Scalar:
        """`begin + 2 width` [s]."""
        return self.begin + 2 * self.width


class Sampled(AbstractReference):
    """A signal given by `values` `(times, joints)` at ascending `times` [s], as read from a file.

    `kind`: `"cubic"` (smooth, through the samples), `"linear"`, or `"hold"` (each value
    held until the next, as a digital output does). Constant before and after.
    """

    times: Float[Array, " times"]
    values: Float[Array, "times joints"]
    kind: str = eqx.field(static=True, default="cubic")

    def __check_init__(self):
        if self.kind not in ("cubic", "linear", "hold"):
            raise ValueError(f"kind = {self.kind!r} is unknown; allowed are cubic, linear, hold.")
        if self.times.shape[0] < 2:
            raise ValueError("a sampled signal needs at least two samples.")

    def __call__(self, t: Scalar) -> tuple[Scalar, ...]:
        """Value for every joint at `t` [s]."""
        last = self.times.shape[0] - 1
        t = jnp.clip(t, self.times[0], self.times[-1])
        i = jnp.clip(jnp.searchsorted(self.times, t, side="right") - 1, 0, last - 1)
        step = self.times[i + 1] - self.times[i]
        x = (t - self.times[i]) / step
        a, b = self.values[i], self.values[i + 1]
        if self.kind == "hold":
            return tuple(jnp.where(x >= 1, b, a))
        if self.kind == "linear":
            return tuple(a + x * (b - a))
        before, after = jnp.maximum(i - 1, 0), jnp.minimum(i + 2, last)
        slope_a = (b - self.values[before]) / (self.times[i + 1] - self.times[before]) * step
        slope_b = (self.values[after] - a) / (self.times[after] - self.times[i]) * step
        return tuple(
            a
            + x * slope_a
            + x**2 * (3 * (b - a) - 2 * slope_a - slope_b)
            + x**3 * (2 * (a - b) + slope_a + slope_b)
        )

    def jumps(self) -> Float[Array, " jumps"]:
        """Every sample of a held signal; none of a smooth one but its ends."""
        if self.kind == "hold":
            return self.times
        return jnp.stack([self.times[0], self.times[-1]])

    def end(self) -> Scalar:
        """Time of the last sample [s]."""
        return self.times[-1]
