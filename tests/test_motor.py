import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from controllers import PD, OpenLoop, Step
from jaxflex import DCMotor, MotorAxis

MOTOR = DCMotor(1.2, 0.062, 0.062, inductance=1.5e-3)
AXIS = MotorAxis(MOTOR, 3e-4, 2e-4)
TIGHT = jf.Adaptive(rtol=1e-10, atol=1e-12)


def arm(motor=MOTOR, drive="voltage"):
    return jf.Arm((), (jf.Joint(hub_inertia=3e-4, viscous_friction=2e-4, motor=motor),), drive=drive)


def test_step_of_voltage_follows_the_closed_form():
    times = jnp.linspace(0.0, 0.5, 51)
    run = jf.simulate(arm(), OpenLoop(), Step((0.0,), (6.0,)), times, method=TIGHT)
    exact = AXIS.speed_after_step(6.0, times)
    np.testing.assert_allclose(run["rate_1"], exact, atol=1e-8 * float(exact[-1]))
    angle = AXIS.angle_after_step(6.0, times)
    np.testing.assert_allclose(run["angle_1"], angle, atol=1e-8 * float(angle[-1]))
    final = 0.062 * 6.0 / (1.2 * 2e-4 + 0.062**2)  # K_m V / (R b + K_m K_b)
    np.testing.assert_allclose(AXIS.speed_after_step(6.0, jnp.array(5.0)), final, rtol=1e-9)


def test_transfer_function_is_the_papers_with_its_missing_term():
    s = 1j * jnp.array([1.0, 30.0, 900.0])
    r, l, k, j, b = 1.2, 1.5e-3, 0.062, 3e-4, 2e-4
    full = k / (s * ((l * s + r) * (j * s + b) + k * k))
    np.testing.assert_allclose(AXIS.open_loop(s), full, rtol=1e-12)
    paper = k / (l * j * s**3 + r * j * s**2 + (r * b + k * k) * s)  # Foldager (4)
    np.testing.assert_allclose(AXIS.open_loop(s), paper, rtol=5e-3)


def test_linearised_axis_has_the_poles_of_the_closed_loop():
    gains = (8.0, 0.1)
    linear = jf.linearise(arm(), jnp.zeros(1), PD(*gains))
    poles = np.sort_complex(np.linalg.eigvals(np.asarray(linear.A)))
    a, b, c, _ = np.asarray(AXIS.denominator())
    k = 0.062
    characteristic = np.array([a, b, c + k * gains[1], k * gains[0]])  # Foldager (7)
    np.testing.assert_allclose(poles, np.sort_complex(np.roots(characteristic)), rtol=1e-8)
    s = 3j
    response = linear.C[0] @ jnp.linalg.solve(s * jnp.eye(3) - linear.A, linear.B @ jnp.array([1.0, s, 0.0]))
    np.testing.assert_allclose(response, AXIS.closed_loop(jnp.asarray(s), *gains), rtol=1e-9)


def test_current_and_torque_drives():
    times = jnp.linspace(0.0, 0.3, 31)
    b, j, k = 2e-4, 3e-4, 0.062
    exact = (1 - np.exp(-np.asarray(times) * b / j)) / b
    by_current = jf.simulate(arm(drive="current"), OpenLoop(), Step((0.0,), (0.5,)), times, method=TIGHT)
    np.testing.assert_allclose(by_current["rate_1"], 0.5 * k * exact, rtol=1e-7, atol=1e-12)
    by_torque = jf.simulate(arm(drive="torque"), OpenLoop(), Step((0.0,), (0.02,)), times, method=TIGHT)
    np.testing.assert_allclose(by_torque["rate_1"], 0.02 * exact, rtol=1e-7, atol=1e-12)


def test_no_inductance_is_the_limit_of_little():
    times = jnp.linspace(0.0, 0.3, 31)
    runs = []
    for inductance in (None, 1e-5):
        motor = DCMotor(1.2, 0.062, 0.062, inductance=inductance)
        runs.append(jf.simulate(arm(motor), OpenLoop(), Step((0.0,), (6.0,)), times)["rate_1"])
    np.testing.assert_allclose(runs[0], runs[1], atol=0.02)


def test_gear_efficiency_and_limit():
    motor = DCMotor(2.0, 0.05, 0.05, gear_ratio=10.0, efficiency=0.8, voltage_limit=12.0)
    np.testing.assert_allclose(motor.joint_torque(jnp.array(3.0)), 0.8 * 10 * 0.05 * 3)
    np.testing.assert_allclose(motor.static_current(jnp.array(12.0), jnp.array(4.0)), (12 - 0.05 * 40) / 2)
    np.testing.assert_allclose(motor.limited(jnp.array([-30.0, 5.0])[1]), 5.0)
    np.testing.assert_allclose(motor.limited(jnp.array(-30.0)), -12.0)
    joint = jf.Joint(rotor_inertia=2e-6, motor=motor)
    np.testing.assert_allclose(joint.reflected_inertia, 2e-4)


def test_drive_without_motor_is_refused():
    with pytest.raises(ValueError, match="needs a motor at every joint"):
        jf.Arm((), (jf.Joint(hub_inertia=1.0),), drive="voltage")


def test_a_chain_of_masses_on_nothing_is_refused():
    link = jf.Link(0.4, 0.15, 0.7, model="lumped")
    with pytest.raises(ValueError, match="give the joint a hub_inertia"):
        jf.Arm((link,), (jf.Joint(),))


def test_functions_transform():
    def speed(resistance):
        axis = MotorAxis(DCMotor(resistance, 0.062, 0.062, inductance=1.5e-3), 3e-4, 2e-4)
        return axis.speed_after_step(6.0, jnp.array(0.1))

    slope = jax.jit(jax.grad(speed))(1.2)
    np.testing.assert_allclose(slope, (speed(1.2 + 1e-6) - speed(1.2 - 1e-6)) / 2e-6, rtol=1e-6)
