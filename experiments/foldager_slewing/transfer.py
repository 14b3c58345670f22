"""Transfer function (12) and its inverse transform in closed form."""

import jax.numpy as jnp
import numpy as np

import jaxflex as jf

from .models import one_way


def deflection_after_step(axis: jf.MotorAxis, times: np.ndarray) -> np.ndarray:
    """Tip deflection [m] after a step of 1 V: the inverse transform of (12) over s, mode by mode.

    Of `s` in the motor's denominator and `s^2` in the mode's numerator one power is left:
    `-K_m psi B s / ((L J s^2 + ...) (C s^2 + D s + G))`.
    """
    link, motor = one_way().link, axis.denominator()[:3]
    torque_constant = axis.motor.joint_torque(jf.scalar(1.0))
    total = jnp.zeros(len(times))
    for k in range(link.shapes):
        mode = jnp.stack([link.modal_inertia[k][k], link.damping[k], link.stiffness[k]])
        push = -torque_constant * link.tip_deflection[k] * link.rotation_integral[k]
        numerator = jnp.stack([push, jnp.zeros_like(push)])
        total = total + jf.step_response(numerator, jnp.convolve(motor, mode), jnp.asarray(times))
    return np.asarray(total)
