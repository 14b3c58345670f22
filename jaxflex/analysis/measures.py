"""How well a move went: vibration left, settling, overshoot, rise, voltage, energy, spectrum.

Every measure is a pure function of arrays over time and works under `vmap` and `grad`.
Times are uniform or not, ascending, in seconds.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..scalars import Scalar, ScalarLike, scalar

Series = Float[Array, " times"]
Path = Float[Array, "times 2"]


def residual_vibration(times: Series, tip: Path, end: ScalarLike, rest: Float[Array, "2"]) -> Scalar:
    """Peak-to-peak excursion of the tip [m] about its resting place after `end` [s].

    The diagonal of the smallest box, along the axes of the base frame, that holds the
    path of the tip from `end` on and `rest` [m], the place where it ought to come to
    rest. The motion of the joints counts, and so does an arm that stops elsewhere: a
    controller cannot score well by giving up on the target.
    """
    after = (times >= scalar(end))[:, None]
    away = jnp.where(after, tip - rest, 0.0)
    high, low = jnp.max(away, axis=0, initial=0.0), jnp.min(away, axis=0, initial=0.0)
    square = jnp.sum((high - low) ** 2)
    return jnp.where(square > 0, jnp.sqrt(jnp.where(square > 0, square, 1.0)), 0.0)


def settling_time(times: Series, tip: Path, target: Float[Array, "2"], band: ScalarLike) -> Scalar:
    """First time [s] after which the tip stays within `band` [m] of `target` [m].

    Infinite if it has not settled by the last sample.
    """
    outside = jnp.linalg.norm(tip - target, axis=-1) > scalar(band)
    last = jnp.max(jnp.where(outside, jnp.arange(times.shape[0]), -1))
    settled = times[jnp.minimum(last + 1, times.shape[0] - 1)]
    return jnp.where(last == times.shape[0] - 1, jnp.inf, settled)


def overshoot(response: Series, start: ScalarLike, target: ScalarLike) -> Scalar:
    """Largest excess of `response` over `target` as a percentage of the distance from `start`."""
    distance = scalar(target) - scalar(start)
    share = (response - scalar(start)) / distance
    return 100 * jnp.maximum(jnp.max(share) - 1, 0.0)


def rise_time(times: Series, response: Series, start: ScalarLike, target: ScalarLike) -> Scalar:
    """Time [s] from 10 % to 90 % of the way from `start` to `target`, between samples by interpolation.

    Infinite if 90 % is not reached.
    """
    share = (response - scalar(start)) / (scalar(target) - scalar(start))

    def crossing(level):
        beyond = share >= level
        index = jnp.argmax(beyond)
        before = jnp.maximum(index - 1, 0)
        climb = share[index] - share[before]
        part = jnp.where(climb > 0, (level - share[before]) / jnp.where(climb > 0, climb, 1.0), 0.0)
        time = times[before] + part * (times[index] - times[before])
        return jnp.where(beyond.any(), time, jnp.inf)

    low, high = crossing(0.1), crossing(0.9)
    return jnp.where(jnp.isfinite(high), high - jnp.where(jnp.isfinite(low), low, 0.0), jnp.inf)


def peak(signal: Series) -> Scalar:
    """Largest magnitude of a signal, such as a voltage."""
    return jnp.max(jnp.abs(signal))


def electrical_energy(times: Series, voltage: Series, current: Series) -> Scalar:
    """`int V i dt` [J] drawn by a motor, by the trapezoidal rule."""
    return jnp.trapezoid(voltage * current, times)


def spectrum(times: Series, signal: Series) -> tuple[Array, Array]:
    """One-sided power spectral density of a uniformly sampled signal, Hann window, mean removed.

    **Returns** frequencies [Hz] and density [unit^2/Hz], each of shape `(times // 2 + 1,)`;
    the density integrates to the variance of the windowed signal.
    """
    count = times.shape[0]
    step = (times[-1] - times[0]) / (count - 1)
    window = jnp.hanning(count)
    transform = jnp.fft.rfft((signal - signal.mean()) * window)
    density = 2 * step * jnp.abs(transform) ** 2 / jnp.sum(window**2)
    return jnp.fft.rfftfreq(count, 1.0) / step, density
