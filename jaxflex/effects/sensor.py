"""Faults of instruments, each at the channel that its location names."""

from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..scalars import Scalar, scalar
from .base import AbstractSensorEffect


class SensorBias(AbstractSensorEffect):
    """An instrument whose zero is off by `bias` [unit of the channel]."""

    bias: Scalar = eqx.field(converter=scalar)
    location: str = eqx.field(static=True, default="angle_1")
    name: ClassVar[str] = "sensor_bias"
    place: ClassVar[str] = "channel"
    units: ClassVar[dict[str, str]] = {"bias": "of the channel"}
    looks_like: ClassVar[str] = "an error of one channel that is the same at all times"

    def read(self, times: Float[Array, " times"], signal: Float[Array, " times"]) -> Float[Array, " times"]:
        """`y + bias`."""
        return signal + self.bias


class SensorGain(AbstractSensorEffect):
    """An instrument whose gain is `1 + error`."""

    error: Scalar = eqx.field(converter=scalar)
    location: str = eqx.field(static=True, default="angle_1")
    name: ClassVar[str] = "sensor_gain"
    place: ClassVar[str] = "channel"
    units: ClassVar[dict[str, str]] = {"error": "1"}
    looks_like: ClassVar[str] = "an error of one channel in proportion to its reading"

    def read(self, times: Float[Array, " times"], signal: Float[Array, " times"]) -> Float[Array, " times"]:
        """`(1 + error) y`."""
        return (1 + self.error) * signal


class SensorLag(AbstractSensorEffect):
    """An instrument with a first-order `lag` [s]: `lag y' + y = signal`."""

    lag: Scalar = eqx.field(converter=scalar)
    location: str = eqx.field(static=True, default="angle_1")
    name: ClassVar[str] = "sensor_lag"
    place: ClassVar[str] = "channel"
    units: ClassVar[dict[str, str]] = {"lag": "s"}
    looks_like: ClassVar[str] = "an error of one channel that follows its slope"

    def read(self, times: Float[Array, " times"], signal: Float[Array, " times"]) -> Float[Array, " times"]:
        """What an instrument in balance with the first sample shows."""
        return first_order_lag(times, signal, self.lag)


class SensorDrift(AbstractSensorEffect):
    """An instrument whose zero moves by `rate` [unit of the channel a second]."""

    rate: Scalar = eqx.field(converter=scalar)
    location: str = eqx.field(static=True, default="angle_1")
    name: ClassVar[str] = "sensor_drift"
    place: ClassVar[str] = "channel"
    units: ClassVar[dict[str, str]] = {"rate": "of the channel a second"}
    looks_like: ClassVar[str] = "an error of one channel that grows along a straight line in time"

    def read(self, times: Float[Array, " times"], signal: Float[Array, " times"]) -> Float[Array, " times"]:
        """`y + rate (t - t_0)`."""
        return signal + self.rate * (times - times[0])


def first_order_lag(
    times: Float[Array, " times"], signal: Float[Array, " times"], lag: Scalar
) -> Float[Array, " times"]:
    """`lag y' + y = signal`, exact for a signal that is straight between its samples.

    Starts in balance with the first sample. Differentiable at `lag = 0`, where it is
    the signal itself.
    """
    some = lag > 0
    safe = jnp.where(some, lag, 1.0)
    steps = jnp.diff(times)
    decay = jnp.where(some, jnp.exp(-steps / safe), 0.0)
    # y1 = decay y0 + (mean - decay) u0 + (1 - mean) u1, with mean = (1 - decay) lag / step
    mean = jnp.where(some, 1 - decay, 1.0) * lag / steps

    def step(y, inputs):
        a, m, u0, u1 = inputs
        y = a * y + (m - a) * u0 + (1 - m) * u1
        return y, y

    _, tail = jax.lax.scan(step, signal[0], (decay, mean, signal[:-1], signal[1:]))
    return jnp.concatenate([signal[:1], tail])
