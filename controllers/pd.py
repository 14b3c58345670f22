"""Proportional-derivative control of every joint, and the open loop."""

from collections.abc import Sequence

import equinox as eqx
from jaxtyping import PyTree

from jaxflex import AbstractController, Measurement, Scalar, ScalarLike, Setpoint, scalar

from .references import scalars

GAINS = ("stiffness", "damping", "rate_feedforward", "acceleration_feedforward")

Gains = ScalarLike | Sequence[ScalarLike]


class PD(AbstractController):
    """`V_a = K_theta (theta_d - theta) + K_omega (theta_d' - theta')` for each joint (Foldager et al. (6)).

    **Fields**, one a joint (in amperes or newton metres in place of volts where the arm's
    drive is a current or a torque):

    - `stiffness` K_theta [V/rad], `damping` K_omega [V s/rad]
    - `rate_feedforward` [V s/rad], `acceleration_feedforward` [V s^2/rad] on the
      reference's rate and acceleration (zero by default)
    """

    stiffness: tuple[Scalar, ...]
    damping: tuple[Scalar, ...]
    rate_feedforward: tuple[Scalar, ...]
    acceleration_feedforward: tuple[Scalar, ...]

    def __init__(
        self,
        stiffness: Gains,
        damping: Gains,
        rate_feedforward: Gains | None = None,
        acceleration_feedforward: Gains | None = None,
    ):
        self.stiffness = scalars(stiffness)
        self.damping = scalars(damping)
        none = (0.0,) * len(self.stiffness)
        self.rate_feedforward = scalars(none if rate_feedforward is None else rate_feedforward)
        self.acceleration_feedforward = scalars(
            none if acceleration_feedforward is None else acceleration_feedforward
        )
        lengths = [len(gains) for gains in vars(self).values()]
        if len(set(lengths)) != 1:
            raise ValueError(
                f"PD: every gain is needed once a joint, found {lengths} values for stiffness, "
                "damping, rate_feedforward and acceleration_feedforward."
            )

    def initial(self) -> PyTree:
        """No memory."""
        return None

    def command(
        self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint
    ) -> tuple[Scalar, ...]:
        """Command of every joint."""
        total = []
        for i in range(len(self.stiffness)):
            value = self.stiffness[i] * (setpoint.value[i] - measurement.angle[i])
            value = value + self.damping[i] * (setpoint.rate[i] - measurement.rate[i])
            value = value + self.rate_feedforward[i] * setpoint.rate[i]
            value = value + self.acceleration_feedforward[i] * setpoint.acceleration[i]
            total.append(value)
        return tuple(total)

    def rate(self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint) -> PyTree:
        """No memory."""
        return None


class OpenLoop(AbstractController):
    """The reference itself as the command: a voltage, current or torque profile."""

    gain: Scalar = eqx.field(converter=scalar, default=1.0)

    def initial(self) -> PyTree:
        """No memory."""
        return None

    def command(
        self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint
    ) -> tuple[Scalar, ...]:
        """`gain` times the reference of every joint."""
        return tuple(self.gain * value for value in setpoint.value)

    def rate(self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint) -> PyTree:
        """No memory."""
        return None
