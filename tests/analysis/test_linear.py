import jax
import jax.numpy as jnp
import numpy as np

import jaxflex as jf
from controllers import PD, Move
from jaxflex.beam.link_model import assumed_modes_link


def test_closed_loop_responds_as_the_simulation():
    arm, gains = jf.foldager_link(0.02, modes=2), PD((10.0,), (0.3,))
    linear = jf.linearise(arm, jnp.zeros(1), gains)
    modes = jf.closed_loop_modes(linear)
    assert modes.damping_ratio.min() > 0
    # the free decay of the linear model, against the simulation of a small deflection
    start = jnp.zeros(linear.A.shape[0]).at[1].set(1e-5)
    times = jnp.linspace(0.0, 0.2, 41)
    states = jax.vmap(lambda t: jax.scipy.linalg.expm(linear.A * t) @ start)(times)
    run = jf.simulate(
        arm, gains, Move((0.0,), (0.0,), 1.0), times, initial=jf.InitialState(deflections=jnp.array([1e-5, 0.0])),
        method=jf.Adaptive(rtol=1e-9, atol=1e-13),
    )  # fmt: skip
    for name in ("angle_1", "tip_deflection_1", "tip_acceleration_1", "voltage_1", "strain_1"):
        row = linear.C[linear.channels.index(name)]
        found = np.asarray(run[name])
        np.testing.assert_allclose(states @ row, found, atol=1e-5 * np.abs(found).max())


def test_poles_of_the_open_arm_are_its_frequencies():
    arm = jf.ahmad_arm(0.05, damping=0.0, drive="torque")
    pose = jnp.array([0.0, 0.7])
    poles = jf.closed_loop_modes(jf.linearise(arm, pose, channels=()))
    elastic = poles.frequency[poles.poles.imag > 1.0]
    np.testing.assert_allclose(elastic, jf.driven_frequencies(arm, pose)[2:], rtol=1e-8)


def test_stiff_springs_lock_the_joints():
    arm = jf.ahmad_arm(0.05)
    held = jf.driven_frequencies(arm, joint_stiffness=jnp.full(2, 1e6))
    np.testing.assert_allclose(held[:5], jf.locked_frequencies(arm), rtol=1e-5)
    np.testing.assert_allclose(
        jf.driven_frequencies(arm, joint_stiffness=jnp.zeros(2)), jf.driven_frequencies(arm)
    )


def test_one_way_model_is_the_coupled_one_with_a_heavy_hub():
    damping = 0.02
    link = jf.Link(0.5, 0.2, 1.0, damping_ratio=damping, modes=3, mode_shapes="clamped_free")
    light = jf.Arm((link,), (jf.Joint(hub_inertia=1.0),))
    basis = link.basis(light.distal(0), False)
    model = assumed_modes_link(
        basis, link.mass_per_length, link.flexural_rigidity, link.damping_ratio, link.gauge_position
    )
    one_way = jf.OneWayLink(model)
    s = 1j * jnp.array([5.0, 20.0, 60.0, 150.0])
    expected = one_way.tip_over_angle(s)
    errors = []
    for hub in (1.0, 10.0):
        arm = jf.Arm((link,), (jf.Joint(hub_inertia=hub),))
        linear = jf.linearise(arm, jnp.zeros(1))
        tip, angle = (linear.channels.index(n) for n in ("tip_deflection_1", "torque_1"))
        # voltage in, deflection and angle out: their ratio is exact whatever the hub
        gain = jnp.stack([linear.C @ jnp.linalg.solve(w * jnp.eye(8) - linear.A, linear.B[:, 0]) for w in s])
        ratio = gain[:, tip] / gain[:, linear.channels.index("angle_1")]
        np.testing.assert_allclose(ratio, expected, rtol=1e-8)
        # the torque that the link returns to the hub fades as the hub grows
        errors.append(np.abs(gain[:, linear.channels.index("angle_1")] * hub * s**2 - 1))
        assert angle >= 0
    np.testing.assert_allclose(errors[0] / errors[1], 10.0, rtol=0.2)


def test_one_way_ode_and_voltage_transfer():
    axis = jf.MotorAxis(jf.DCMotor(1.2, 0.062, 0.062, inductance=1.5e-3), 3e-4, 2e-4)
    link = jf.Link(0.395, 0.149, 0.7, damping_ratio=0.01, modes=2, mode_shapes="clamped_free")
    arm = jf.Arm((link,), (jf.Joint(hub_inertia=1.0),))
    model = link.discretise(arm.distal(0), False, jf.Joint())
    one_way = jf.OneWayLink(model)
    s = jnp.array([30.0j])
    np.testing.assert_allclose(
        one_way.tip_over_voltage(s, axis), one_way.tip_over_angle(s) * axis.open_loop(s)
    )
    # (9) under a hub acceleration exp(s t): eta = H exp(s t), tip = sum psi eta
    w = 30.0
    rows = one_way.accelerations((0.0, 0.0), (0.0, 0.0), jnp.array(1.0))
    eta = [
        r / (-(w**2) + k / m[i] + 1j * w * d / m[i])
        for i, (r, k, m, d) in enumerate(
            zip(rows, model.stiffness, model.modal_inertia, model.damping, strict=True)
        )
    ]
    tip = sum(p * e for p, e in zip(model.tip_deflection, eta, strict=True))
    np.testing.assert_allclose(tip, one_way.tip_over_angle(s)[0] / s[0] ** 2, rtol=1e-9)
