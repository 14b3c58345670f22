import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from controllers import PD, Move
from jaxflex.sensors import first_order_lag, measured_deflection

TIMES = jnp.linspace(0.0, 0.4, 2001)


def run():
    arm = jf.foldager_link(0.02, modes=2)
    return arm, jf.simulate(arm, PD((10.0,), (0.3,)), Move((0.0,), (0.5,), 0.3), TIMES)


def test_channels_agree_with_each_other():
    arm, trajectory = run()
    t = np.asarray(TIMES)
    angle, bend = np.asarray(trajectory["angle_1"]), np.asarray(trajectory["tip_deflection_1"])
    length = 0.395
    x = length * np.cos(angle) - bend * np.sin(angle)
    y = length * np.sin(angle) + bend * np.cos(angle)
    np.testing.assert_allclose(trajectory["tip_x"], x, atol=1e-12)
    np.testing.assert_allclose(trajectory["tip_y"], y, atol=1e-12)
    ax, ay = (np.gradient(np.gradient(p, t), t) for p in (x, y))
    across = -np.sin(angle) * ax + np.cos(angle) * ay
    measured = np.asarray(trajectory["tip_acceleration_1"])
    np.testing.assert_allclose(measured[5:-5], across[5:-5], atol=2e-3 * np.abs(measured).max())
    np.testing.assert_allclose(np.gradient(angle, t)[2:-2], trajectory["rate_1"][2:-2], atol=1e-4)
    np.testing.assert_allclose(trajectory["torque_1"], 0.062 * np.asarray(trajectory["current_1"]))
    model = arm.assemble()
    bending = sum(
        np.asarray(k * e) for k, e in zip(model.links[0].gauge_curvature, trajectory.state.q[1:], strict=True)
    )
    np.testing.assert_allclose(trajectory["strain_1"], 1.4e-3 / 2 * bending, rtol=1e-12)
    assert trajectory.unit("strain_1") == "1" and trajectory.unit("tip_x") == "m"


def test_static_strain_of_a_tip_force():
    # a cantilever under gravity and payload: root strain = h M / (2 EI)
    link = jf.Link.from_rectangle(0.4, 0.04, 2e-3, 70e9, 2700.0, modes=6, mode_shapes="clamped_mass")
    arm = jf.Arm((link,), (jf.Joint(hub_inertia=1e-3),), jf.Payload(0.05), gravity=9.81)
    model = arm.assemble()
    weight = jax.grad(lambda q: jf.potential_energy(model, tuple(q)))(jnp.zeros(model.size))
    eta = -weight[1:] / jnp.stack(model.stiffness()[1:])
    strain = 1e-3 * jnp.dot(jnp.stack(model.links[0].gauge_curvature), eta)
    moment = 9.81 * (0.05 * 0.4 + float(link.mass) * 0.2)
    np.testing.assert_allclose(strain, -1e-3 * moment / float(link.flexural_rigidity), rtol=0.02)


def test_lag_is_exact_and_differentiable_at_zero():
    t = jnp.linspace(0.0, 1.0, 401)
    ramp = jf.Sensor(lag=0.05).read(t, t)
    np.testing.assert_allclose(ramp, t - 0.05 * (1 - jnp.exp(-t / 0.05)), atol=1e-12)
    np.testing.assert_allclose(first_order_lag(t, jnp.sin(t), jnp.array(0.0)), jnp.sin(t))
    slope = jax.jacfwd(lambda lag: first_order_lag(t, jnp.sin(t), lag))(0.0)
    np.testing.assert_allclose(slope[1:], -jnp.diff(jnp.sin(t)) / jnp.diff(t), atol=1e-9)


def test_gain_bias_noise_and_counts():
    t = jnp.linspace(0.0, 1.0, 5001)
    signal = jnp.sin(3 * t)
    sensor = jf.Sensor(gain=1.1, bias=0.2, noise=0.01)
    np.testing.assert_allclose(sensor.read(t, signal), 1.1 * signal + 0.2)
    noise = sensor.read(t, signal, jax.random.key(0)) - sensor.read(t, signal)
    np.testing.assert_allclose(noise.std(), 0.01, rtol=0.05)
    count = 2 * np.pi / 1024
    encoder = jf.Sensor(resolution=count)
    steps = np.asarray(encoder.read(t, signal)) / count
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
    slope = jax.grad(lambda g: jf.Sensor(gain=g, resolution=count).read(t, signal).sum())(1.0)
    np.testing.assert_allclose(slope, signal.sum())


def test_a_gauge_scaled_under_a_weight_at_the_tip_shows_the_tip_under_one():
    """Statically the two agree; of the second mode the gauge shows many times the tip's deflection."""
    link = jf.Link(0.4, 0.15, 0.7, modes=8, mode_shapes="clamped_free", gauge_position=0.02)
    by_tip, by_gauge = (
        jf.Arm((dataclasses.replace(link, deflection_from=kind),), (jf.Joint(hub_inertia=1e-3),)).assemble()
        for kind in ("tip", "gauge")
    )
    (constants,) = by_tip.links
    bent = tuple(w / k for w, k in zip(constants.tip_deflection, constants.stiffness, strict=True))
    shown = [float(measured_deflection(arm.links[0], bent)) for arm in (by_tip, by_gauge)]
    np.testing.assert_allclose(shown[0], 0.4**3 / (3 * 0.7), rtol=1e-3)
    np.testing.assert_allclose(shown[1], shown[0], rtol=0.02)
    second = tuple(jnp.eye(8)[1])
    shares = [abs(float(measured_deflection(arm.links[0], second))) for arm in (by_tip, by_gauge)]
    assert shares[1] > 5 * shares[0]


def test_an_unknown_instrument_is_refused():
    with pytest.raises(ValueError, match="deflection_from"):
        jf.Link(0.4, 0.15, 0.7, deflection_from="camera")
