"""What the simulation asks of a controller and of the reference it follows."""

from abc import abstractmethod
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from .brief import brief
from .scalars import Scalar


class Setpoint(NamedTuple):
    """Reference of every joint: tuples of scalars [rad], [rad/s], [rad/s^2].

    Where the reference is a torque, current or voltage profile, `value` is that profile.
    """

    value: tuple
    rate: tuple
    acceleration: tuple


class Measurement(NamedTuple):
    """What a controller may read, tuples of scalars joint by joint or link by link.

    `angle` [rad], `rate` [rad/s] of the joints; `current` [A] of the motor of every
    joint, zero where it is no state (it then follows from the command, which may depend
    on it); `tip_deflection` [m] of the links; `curvature` [1/m] at the strain gauge of
    the links with `curvature_rate` [1/(m s)], and `strain` [1], `thickness / 2` times
    that, None for a link whose thickness is not given.
    """

    angle: tuple
    rate: tuple
    current: tuple
    tip_deflection: tuple
    curvature: tuple
    curvature_rate: tuple
    strain: tuple


class AbstractReference(eqx.Module):
    """A signal for every joint as a function of time, differentiable in its parameters."""

    __repr__ = brief

    @abstractmethod
    def __call__(self, t: Scalar) -> tuple[Scalar, ...]:
        """Value of the signal for every joint at time `t` [s]."""

    @abstractmethod
    def jumps(self) -> Float[Array, " jumps"]:
        """Times [s] at which the signal or its derivatives jump; the solver steps to them."""

    @abstractmethod
    def end(self) -> Scalar:
        """Time [s] at which the commanded move is over and the signal stays constant."""

    def setpoint(self, t: Scalar) -> Setpoint:
        """Value, rate and acceleration at `t` [s]: the derivatives by autodiff in time."""
        one = jnp.ones_like(t)

        def with_rate(t):
            return jax.jvp(self, (t,), (one,))

        (value, rate), (_, acceleration) = jax.jvp(with_rate, (t,), (one,))
        return Setpoint(value, rate, acceleration)


class AbstractController(eqx.Module):
    """A control law: measurement and setpoint in, one command for every joint out.

    The command is a voltage [V], current [A] or torque [N m], as the arm's drive says.
    A controller with memory keeps it in a pytree of arrays, scalars for speed, a part of the
    simulated state: `rate` is its time derivative, integrated by the solver under continuous
    control; under sampled control `advance` takes it from one sample to the next. A
    controller with a `period` is sampled wherever it is simulated.
    """

    __repr__ = brief

    def period(self) -> Scalar | None:
        """Time [s] from sample to sample; None for a law that is not of itself sampled."""
        return None

    @abstractmethod
    def initial(self) -> PyTree:
        """Memory at the start; None for a law without memory."""

    def begin(self, measurement: Measurement) -> PyTree:
        """Memory at the start of a run whose first reading is `measurement`: `initial`, unless a law knows better."""
        return self.initial()

    @abstractmethod
    def command(
        self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint
    ) -> tuple[Scalar, ...]:
        """Command for every joint at time `t` [s]."""

    @abstractmethod
    def rate(self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint) -> PyTree:
        """Time derivative of the memory, of the same structure."""

    def advance(
        self, period: Scalar, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint
    ) -> PyTree:
        """Memory one sample, `period` [s], after `t`: an Euler step, unless a law knows better."""
        slope = self.rate(t, memory, measurement, setpoint)
        return jax.tree_util.tree_map(lambda m, s: m + period * s, memory, slope)
