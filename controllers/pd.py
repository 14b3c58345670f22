"""Proportional-derivative control of every joint, and the open loop."""

import equinox as eqx
from jaxtyping import PyTree

from jaxflex import AbstractController, Measurement, Scalar, Setpoint, scalar

from .references import scalars


class PD(AbstractController):
    """`V_a = K_theta (theta_d - theta) + K_omega (theta_d' - theta')` for each joint (Foldager et al. (6)).

    **Fields**, one a joint (in amperes or newton metres in place of volts where the arm's
    drive is a current or a torque):

    - `stiffness` K_theta [V/rad], `damping` K_omega [V s/rad]
    - `rate_feedforward` [V s/rad], `acceleration_feedforward` [V s^2/rad] on the
      reference's rate and acceleration (None: none)
    """

    stiffness: tuple[Scalar, ...] = eqx.field(converter=scalars)
    damping: tuple[Scalar, ...] = eqx.field(converter=scalars)
    rate_feedforward: tuple[Scalar, ...] | None = None
    acceleration_feedforward: tuple[Scalar, ...] | None = None

    def __check_init__(self):
        lengths = {len(self.stiffness), len(self.damping)}
        for extra in (self.rate_feedforward, self.acceleration_feedforward):
            if extra is not None:
                lengths.add(len(extra))
        if len(lengths) != 1:
            raise ValueError("PD: every gain must be given for the same number of joints.")

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
            if self.rate_feedforward is not None:
                value = value + self.rate_feedforward[i] * setpoint.rate[i]
            if self.acceleration_feedforward is not None:
                value = value + self.acceleration_feedforward[i] * setpoint.acceleration[i]
            total.append(value)
        return tuple(total)

    def rate(
        self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint
    ) -> PyTree:
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

    def rate(
        self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint
    ) -> PyTree:
        """No memory."""
        return None
