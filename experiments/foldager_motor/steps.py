"""Steps of voltage and of current, with the loop open and closed: simulated, and in closed form."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import controllers as ctl
import jaxflex as jf

from ..foldager import HUB_INERTIA

BANDWIDTH = 60.0  # rad/s, of the PD loops
TIGHT = jf.Adaptive(rtol=1e-10, atol=1e-12)


class Case(NamedTuple):
    """One panel of Fig. 7: times [s], angle [rad] and speed [rad/s], simulated and in closed form."""

    title: str
    times: Array
    simulated: tuple[Array, Array]
    closed_form: tuple[Array, Array]

    def error(self) -> float:
        """Largest difference of the two as a share of the largest value, of angle or speed."""
        pairs = zip(self.simulated, self.closed_form, strict=True)
        return max(float(jnp.abs(a - b).max() / jnp.abs(b).max()) for a, b in pairs)


def motor_arm(drive: str) -> jf.Arm:
    """The motor and hub of the paper's link, without the link, commanded by `drive`."""
    joint = jf.foldager_link(hub_inertia=HUB_INERTIA).joints[0]
    return jf.Arm((), (joint,), drive=drive)


def motor_axis() -> jf.MotorAxis:
    """The same in closed form."""
    joint = motor_arm("voltage").joints[0]
    return jf.MotorAxis(joint.motor, joint.hub_inertia, joint.viscous_friction)


def gains(drive: str) -> ctl.PD:
    """PD gains that are critically damped at `BANDWIDTH` where inductance is left out."""
    return ctl.textbook_pd(motor_arm(drive), jnp.zeros(1), BANDWIDTH)


def _simulated(drive, controller, size, times):
    run = jf.simulate(motor_arm(drive), controller, ctl.Step((0.0,), (size,)), times, method=TIGHT)
    return run["angle_1"], run["rate_1"]


def _voltage_loop(controller, axis, times):
    """Angle and speed of (7) after a step of its reference, the step's own derivative left out.

    (7) has `K_omega d theta_d/dt` on its right side, an impulse for a step; the controller
    of the simulation does not see that impulse, and neither does this.
    """
    torque_constant = axis.motor.torque_constant
    push = torque_constant * controller.stiffness[0]
    closed = axis.denominator().at[-2].add(torque_constant * controller.damping[0]).at[-1].add(push)
    angle = jf.step_response(push[None], closed, times)
    return angle, jf.step_response(jnp.stack([push, jnp.zeros_like(push)]), closed, times)


def cases(count: int) -> list[Case]:
    """The four cases, `count` times each."""
    axis, torque_constant = motor_axis(), motor_axis().motor.torque_constant
    j, b = axis.inertia, axis.viscous_friction
    short, long = jnp.linspace(0.0, 0.25, count), jnp.linspace(0.0, 1.0, count)
    turns = BANDWIDTH * short
    voltage, current = 6.0, 0.2
    share = -jnp.expm1(-long * b / j)
    speed = torque_constant * current / b
    return [
        Case(
            f"{voltage:g} V, open loop", short,
            _simulated("voltage", ctl.OpenLoop(), voltage, short),
            (axis.angle_after_step(voltage, short), axis.speed_after_step(voltage, short)),
        ),
        Case(
            "voltage, PD to 1 rad", short,
            _simulated("voltage", gains("voltage"), 1.0, short),
            _voltage_loop(gains("voltage"), axis, short),
        ),
        Case(
            f"{current:g} A, open loop", long,
            _simulated("current", ctl.OpenLoop(), current, long),
            (speed * (long - j / b * share), speed * share),
        ),
        Case(
            "current, PD to 1 rad", short,
            _simulated("current", gains("current"), 1.0, short),
            (1 - (1 + turns) * jnp.exp(-turns), BANDWIDTH * turns * jnp.exp(-turns)),  # double pole
        ),
    ]  # fmt: skip


def poles_hz(drive: str) -> np.ndarray:
    """Poles of the position loop, as frequencies [Hz]."""
    return np.asarray(
        jf.closed_loop_modes(jf.linearise(motor_arm(drive), jnp.zeros(1), gains(drive))).frequency
    )
