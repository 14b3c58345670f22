"""PID control that does not wind up, and damping by the strain gauge."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import PyTree

from jaxflex import AbstractController, Measurement, Scalar, Setpoint, scalar

from .pd import PD, Gains
from .references import scalars


class PID(AbstractController):
    """`pd` plus `K_i int (theta_d - theta) dt` for each joint, within `limit`.

    **Fields**: `pd`; `integral` K_i [V/(rad s)] and `limit` [V], one a joint (or in
    amperes or newton metres, as the drive commands); `tracking_time` T [s];
    `anti_windup`, what keeps the integral from growing while the command is at its limit:

    - `"back_calculation"`: `I' = K_i e + (limited - asked) / T` (Åström and Hägglund 1995, 3.5)
    - `"clamping"`: no integration that pushes further past the limit
    - `"none"`

    The command is limited in each case, as the amplifier would.
    """

    pd: PD
    integral: tuple[Scalar, ...] = eqx.field(converter=scalars)
    limit: tuple[Scalar, ...] = eqx.field(converter=scalars)
    tracking_time: Scalar = eqx.field(converter=scalar, default=0.1)
    anti_windup: str = eqx.field(static=True, default="back_calculation")

    def __check_init__(self):
        joints = len(self.pd.stiffness)
        if not len(self.integral) == len(self.limit) == joints:
            raise ValueError(
                f"PID: integral and limit are needed once a joint, {joints} each; "
                f"found {len(self.integral)} and {len(self.limit)}."
            )
        if self.anti_windup not in ("back_calculation", "clamping", "none"):
            raise ValueError(
                f"PID: anti_windup = {self.anti_windup!r} is unknown; allowed are "
                "'back_calculation', 'clamping' and 'none'."
            )

    def initial(self) -> PyTree:
        """The integrals, in units of the command, at zero."""
        return (scalar(0.0),) * len(self.integral)

    def _asked(self, t, memory, measurement, setpoint):
        direct = self.pd.command(t, None, measurement, setpoint)
        return [u + i for u, i in zip(direct, memory, strict=True)]

    def command(
        self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint
    ) -> tuple[Scalar, ...]:
        """Command of every joint, limited."""
        asked = self._asked(t, memory, measurement, setpoint)
        return tuple(jnp.clip(u, -top, top) for u, top in zip(asked, self.limit, strict=True))

    def rate(self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint) -> PyTree:
        """Time derivative of the integrals."""
        slopes = []
        for i, u in enumerate(self._asked(t, memory, measurement, setpoint)):
            slope = self.integral[i] * (setpoint.value[i] - measurement.angle[i])
            excess = u - jnp.clip(u, -self.limit[i], self.limit[i])
            if self.anti_windup == "back_calculation":
                slope = slope - excess / self.tracking_time
            elif self.anti_windup == "clamping":
                slope = jnp.where(excess * slope > 0, 0.0, slope)
            slopes.append(slope)
        return tuple(slopes)


class StrainRateFeedback(AbstractController):
    """`K w''_t` for each joint: the rate of the curvature at the gauge of the link it turns.

    A joint accelerated in proportion to the rate at which its link bends damps the link
    (Luo 1993), for K > 0 [V m s] (or in amperes or newton metres). Add it to a `PD` with `Sum`.
    """

    gain: tuple[Scalar, ...]

    def __init__(self, gain: Gains):
        self.gain = scalars(gain)

    def initial(self) -> PyTree:
        """No memory."""
        return None

    def command(
        self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint
    ) -> tuple[Scalar, ...]:
        """Command of every joint."""
        return tuple(k * rate for k, rate in zip(self.gain, measurement.curvature_rate, strict=True))

    def rate(self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint) -> PyTree:
        """No memory."""
        return None
