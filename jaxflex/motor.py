r"""The permanent-magnet DC motor (Foldager et al. (1)-(7)).

            R          L
V_a  o----/\/\/\----UUUUU----+
              i_a ->         |         T_m = K_m i_a
                            (M) =====> gear 1:G, efficiency e =====> joint
                             |
0    o-----------------------+         V_b = K_b omega   (back-EMF)
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Complex, Float

from .brief import brief
from .scalars import Scalar, ScalarLike, optional_scalar, scalar


class DCMotor(eqx.Module):
    """A DC motor with its gear, as seen from the joint.

    **Fields** (shape `()`):

    - `resistance` R [ohm], `inductance` L [H] (None: the current follows at once)
    - `torque_constant` K_m [N m/A], `back_emf_constant` K_b [V s/rad]
    - `gear_ratio` G, motor turns for one turn of the joint; `efficiency` of motor and gear
    - `voltage_limit` [V] of the amplifier (None: none)
    """

    resistance: Scalar = eqx.field(converter=scalar)
    torque_constant: Scalar = eqx.field(converter=scalar)
    back_emf_constant: Scalar = eqx.field(converter=scalar)
    inductance: Scalar | None = eqx.field(converter=optional_scalar, default=None)
    gear_ratio: Scalar = eqx.field(converter=scalar, default=1.0)
    efficiency: Scalar = eqx.field(converter=scalar, default=1.0)
    voltage_limit: Scalar | None = eqx.field(converter=optional_scalar, default=None)

    __repr__ = brief

    def limited(self, voltage: Scalar) -> Scalar:
        """The voltage [V] that reaches the winding: the command within the limit."""
        if self.voltage_limit is None:
            return voltage
        return jnp.clip(voltage, -self.voltage_limit, self.voltage_limit)

    def armature_voltage(self, voltage: Scalar, joint_rate: Scalar) -> Scalar:
        """`V_a' = V_a - K_b G theta'` [V]: what is left to drive current (Foldager (1))."""
        return voltage - self.back_emf_constant * self.gear_ratio * joint_rate

    def current_rate(self, current: Scalar, voltage: Scalar, joint_rate: Scalar) -> Scalar:
        """`di_a/dt = (V_a' - R i_a) / L` [A/s] (Foldager (1))."""
        if self.inductance is None:
            raise ValueError("the motor has no inductance: its current is static_current, not a state.")
        drop = self.armature_voltage(voltage, joint_rate) - self.resistance * current
        return drop / self.inductance

    def static_current(self, voltage: Scalar, joint_rate: Scalar) -> Scalar:
        """`i_a = V_a' / R` [A], the current of a motor without inductance (Foldager (2), L = 0)."""
        return self.armature_voltage(voltage, joint_rate) / self.resistance

    def joint_torque(self, current: Scalar) -> Scalar:
        """`e G K_m i_a` [N m] at the joint (Foldager, below (2))."""
        return self.efficiency * self.gear_ratio * self.torque_constant * current


class MotorAxis(eqx.Module):
    """A motor that turns an inertia alone: Foldager et al. (3)-(7) in closed form.

    `inertia` J [kg m^2] and `viscous_friction` b [N m s/rad], both at the joint.
    """

    motor: DCMotor
    inertia: Scalar = eqx.field(converter=scalar)
    viscous_friction: Scalar = eqx.field(converter=scalar, default=0.0)

    __repr__ = brief

    def denominator(self) -> Float[Array, " 4"]:
        """`[L J, R J + L b, R b + K_m K_b, 0]`: denominator of (4), highest power first.

        The paper's (4) leaves out `L b s^2`, which is there when (2) and (3) are combined.
        Motor constants are those at the joint, gear and efficiency included.
        """
        m, j, b = self.motor, self.inertia, self.viscous_friction
        inductance = scalar(0.0) if m.inductance is None else m.inductance
        torque = m.joint_torque(scalar(1.0))
        emf = m.back_emf_constant * m.gear_ratio
        return jnp.stack(
            [
                inductance * j,
                m.resistance * j + inductance * b,
                m.resistance * b + torque * emf,
                jnp.zeros_like(j),
            ]
        )

    def open_loop(self, s: Complex[Array, "..."]) -> Complex[Array, "..."]:
        """`theta(s) / V_a(s)` [rad/V] (Foldager (4))."""
        return self.motor.joint_torque(scalar(1.0)) / jnp.polyval(self.denominator(), s)

    def closed_loop(
        self, s: Complex[Array, "..."], stiffness: ScalarLike, damping: ScalarLike
    ) -> Complex[Array, "..."]:
        """`theta(s) / theta_d(s)` under PD with K_theta [V/rad] and K_omega [V s/rad] (Foldager (7))."""
        gain = self.open_loop(s) * (scalar(damping) * s + scalar(stiffness))
        return gain / (1 + gain)

    def speed_after_step(self, voltage: ScalarLike, t: Float[Array, "..."]) -> Float[Array, "..."]:
        """Speed [rad/s] at `t` [s] after a step of `voltage` [V] from rest.

        The inverse transform of `s` times (4) for a step:
        `w(t) = w_inf (1 + (p2 exp(p1 t) - p1 exp(p2 t)) / (p1 - p2))` with p1, p2 the poles.
        Both poles must differ and the inductance must be present.
        """
        final, p1, p2 = self._step(voltage)
        mix = (p2 * jnp.exp(p1 * t) - p1 * jnp.exp(p2 * t)) / (p1 - p2)
        return final * (1 + mix.real)

    def angle_after_step(self, voltage: ScalarLike, t: Float[Array, "..."]) -> Float[Array, "..."]:
        """Angle [rad] at `t` [s] after a step of `voltage` [V] from rest: the speed's integral.

        `w_inf (t + (p2/p1 (exp(p1 t) - 1) - p1/p2 (exp(p2 t) - 1)) / (p1 - p2))`, under the
        conditions of `speed_after_step`.
        """
        final, p1, p2 = self._step(voltage)
        mix = (p2 / p1 * jnp.expm1(p1 * t) - p1 / p2 * jnp.expm1(p2 * t)) / (p1 - p2)
        return final * (t + mix.real)

    def _step(self, voltage: ScalarLike) -> tuple[Array, Array, Array]:
        """Final speed [rad/s] under `voltage` [V], and the two poles [rad/s] of the speed."""
        a, b, c, _ = self.denominator()
        root = jnp.sqrt((b * b - 4 * a * c).astype(complex))
        final = self.motor.joint_torque(scalar(1.0)) * scalar(voltage) / c
        return final, (-b + root) / (2 * a), (-b - root) / (2 * a)
