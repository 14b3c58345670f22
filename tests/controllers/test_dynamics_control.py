"""Inverse dynamics, computed torque and learning."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from controllers import (
    PD,
    ComputedTorque,
    InverseDynamics,
    Move,
    Step,
    Sum,
    ZeroOrderHold,
    impulse_response,
    learn,
    learning_gain,
)
from jaxflex.dynamics.lagrange import accelerations


def test_inverse_dynamics_recovers_the_torque_of_a_simulated_motion():
    arm = jf.ahmad_arm(0.05, modes=1, drive="torque")
    move = Move((0.0, 0.3), (0.2, 0.1), 0.5)
    times = jnp.linspace(0.0, 0.6, 7)
    law = PD((2.0, 1.0), (1.0, 0.4))
    start = jf.InitialState(angles=jnp.array([0.0, 0.3]))
    run = jf.simulate(arm, law, move, times, initial=start, method=jf.Adaptive(rtol=1e-9, atol=1e-11))
    model = arm.assemble()

    @jax.jit
    def forces(q, qd, torques):
        zeros = (jnp.zeros(()),) * (model.size - 2)
        damped = tuple(d * v for d, v in zip(model.damping(), qd, strict=True))
        force = tuple(t - d for t, d in zip(torques + zeros, damped, strict=True))
        qdd = accelerations(model, q, qd, force)
        # and by the textbook terms, another path through autodiff
        m, c, g = (
            jf.mass_matrix(model, jnp.stack(q)),
            jf.coriolis_matrix(model, jnp.stack(q), jnp.stack(qd)),
            jf.gravity_vector(model, jnp.stack(q)),
        )
        terms = m @ jnp.stack(qdd) + c @ jnp.stack(qd) + g + jnp.stack(damped)
        return jnp.stack(jf.inverse_dynamics(model, q, qd, qdd)), jnp.stack(torques + zeros), terms

    for k in range(1, 7):
        q, qd = (tuple(x[k] for x in part) for part in (run.state.q, run.state.qd))
        found, applied, terms = forces(q, qd, tuple(run[f"torque_{i}"][k] for i in (1, 2)))
        np.testing.assert_allclose(found, applied, atol=1e-9)
        np.testing.assert_allclose(found, terms, atol=1e-8)


@pytest.fixture(scope="module")
def rigid():
    links = tuple(jf.Link(0.4, 0.3, 1.0, modes=0) for _ in range(2))
    return jf.Arm(links, (jf.Joint(0.02, viscous_friction=0.1), jf.Joint(0.02)), jf.Payload(0.2))


def test_feedforward_alone_moves_a_rigid_arm_exactly(rigid):
    move = Move((0.0, 0.2), (1.0, -0.8), 0.4)
    start, times = jf.InitialState(angles=jnp.array([0.0, 0.2])), jnp.linspace(0.0, 0.4, 21)
    run = jf.simulate(
        rigid, InverseDynamics(rigid), move, times, initial=start, method=jf.Adaptive(rtol=1e-9)
    )
    for i in (1, 2):
        np.testing.assert_allclose(run[f"angle_{i}"], run[f"reference_{i}"], atol=1e-6)


def test_computed_torque_makes_the_error_linear(rigid):
    start, times = jf.InitialState(angles=jnp.array([0.3, -0.4])), jnp.linspace(0.0, 1.0, 21)
    law = ComputedTorque(rigid, (25.0, 25.0), (10.0, 10.0))
    run = jf.simulate(
        rigid, law, Step((0.0, 0.0), (0.0, 0.0)), times, initial=start, method=jf.Adaptive(rtol=1e-9)
    )
    t = np.asarray(times)
    for name, e0 in (("angle_1", 0.3), ("angle_2", -0.4)):
        np.testing.assert_allclose(run[name], e0 * (1 + 5 * t) * np.exp(-5 * t), atol=1e-6)


def test_feedforward_of_a_flexible_arm_follows_better_than_that_of_a_rigid_one():
    arm = jf.foldager_link(0.02, modes=1)
    stiff = jf.Arm(
        (jf.Link(0.395, float(arm.links[0].mass_per_length), 1.0, modes=0),),
        arm.joints,
        arm.payload,
        None,
        "voltage",
    )
    move, times = Move((0.0,), (0.5,), 0.5), jnp.linspace(0.0, 0.5, 51)
    pd = PD((10.0,), (0.3,))

    def error(believed):
        law = Sum((pd, InverseDynamics(believed))) if believed is not None else pd
        run = jf.simulate(arm, law, move, times)
        return float(np.abs(run["angle_1"] - run["reference_1"]).max())

    assert error(arm) < error(None) / 5
    assert error(arm) < 1.2 * error(stiff)


def linear_axis():
    return jf.Arm((), (jf.Joint(hub_inertia=0.02, viscous_friction=0.05),))


def test_learning_converges_as_the_linear_theory_says():
    period, samples = 0.02, 40
    arm, law = linear_axis(), ZeroOrderHold(PD((2.0,), (0.15,)), 0.02)
    move = Move((0.0,), (1.0,), 0.6)
    response = impulse_response(arm, jnp.zeros(1), law, samples)
    gain = learning_gain(response, 0.02)
    found = learn(arm, law, move, gain, period, 6, method=jf.Adaptive(rtol=1e-10, atol=1e-12))
    # the arm is linear, so every trial is e+ = (I - G L) e, from the first
    times = period * jnp.arange(samples + 1)
    run = jf.simulate(arm, law, move, times, method=jf.Adaptive(rtol=1e-10, atol=1e-12))
    error = np.asarray(run["reference_1"] - run["angle_1"])[1:]
    np.testing.assert_allclose(gain.memory, np.eye(samples), atol=1e-9)  # nothing is forgotten
    contraction = np.eye(samples) - np.asarray(response @ gain.correction)
    assert np.linalg.norm(contraction, 2) < 1
    for measured in found.errors:
        np.testing.assert_allclose(measured, np.sqrt(np.mean(error**2)), rtol=1e-4, atol=1e-9)
        error = contraction @ error
    assert found.errors[-1] < found.errors[0] / 50


def test_impulse_response_is_that_of_the_simulation():
    arm, law = linear_axis(), ZeroOrderHold(PD((2.0,), (0.15,)), 0.02)
    from controllers import Replayed

    table = jnp.asarray(np.random.default_rng(1).normal(size=(10, 1)))
    run = jf.simulate(
        arm, ZeroOrderHold(Sum((law, Replayed(table, 0.02))), 0.02), Step((0.0,), (0.0,)),
        0.02 * jnp.arange(11), method=jf.Adaptive(rtol=1e-10, atol=1e-12),
    )  # fmt: skip
    response = impulse_response(arm, jnp.zeros(1), law, 10)
    np.testing.assert_allclose(run["angle_1"][1:], response @ table.ravel(), atol=1e-8)
    with pytest.raises(ValueError, match="ZeroOrderHold"):
        impulse_response(arm, jnp.zeros(1), PD((2.0,), (0.15,)), 10)


def test_learning_carries_over_to_a_flexible_arm_of_another_payload():
    arm, period = jf.foldager_link(0.02, modes=1), 0.01
    law, move = ZeroOrderHold(PD((10.0,), (0.3,)), period), Move((0.0,), (0.4,), 0.4)
    gain = learning_gain(impulse_response(arm, jnp.zeros(1), law, 60), 0.05)
    found = learn(arm.with_payload(0.03), law, move, gain, period, 5)
    assert np.all(np.diff(found.errors) < 0) and found.errors[-1] < found.errors[0] / 5


def test_forgetting_keeps_trials_from_creeping_up_where_the_model_is_wrong():
    period, samples, pose = 5e-3, 100, jnp.zeros(1)
    law = ZeroOrderHold(PD((10.0,), (0.3,)), period)
    model, arm = (
        np.asarray(impulse_response(jf.foldager_link(mass, modes=1), pose, law, samples))
        for mass in (0.0, 0.02)
    )
    wanted = np.linspace(0.0, 1.0, samples) ** 2

    def repeated(forgetting, response, trials):
        gain = learning_gain(jnp.asarray(model), 0.05, forgetting)
        feedforward, errors = np.zeros(samples), []
        for _ in range(trials):
            error = wanted - response @ feedforward
            errors.append(np.linalg.norm(error))
            feedforward = np.asarray(gain.memory @ feedforward + gain.correction @ error)
        return feedforward, np.array(errors)

    _, creeping = repeated(0.0, arm, 40)
    _, settled = repeated(0.3, arm, 40)
    assert creeping[-1] > 10 * creeping.min()
    assert settled[-1] < 1.1 * settled.min() < settled[0] / 50
    # the price, on the very arm of the model: trials settle where |e|^2 + mu |f|^2 is least
    found, _ = repeated(0.3, model, 200)
    weight = np.sqrt(0.3) * 0.05 * np.linalg.norm(model, 2)
    least, *_ = np.linalg.lstsq(
        np.vstack([model, weight * np.eye(samples)]), np.concatenate([wanted, np.zeros(samples)])
    )
    np.testing.assert_allclose(found, least, atol=1e-9 * np.abs(least).max())


def test_derivatives_through_computed_torque():
    arm = jf.Arm((jf.Link(0.4, 0.3, 1.0, modes=0),), (jf.Joint(0.02, viscous_friction=0.1),), jf.Payload(0.2))
    times = jnp.linspace(0.0, 0.2, 5)

    def final(stiffness):
        law = ComputedTorque(arm, (stiffness,), (10.0,))
        start = jf.InitialState(angles=jnp.array([0.1]))
        run = jf.simulate(
            arm, law, Move((0.0,), (0.3,), 0.15), times, channels=["tip_y"], initial=start,
            method=jf.Adaptive(rtol=1e-9, atol=1e-11, stability=None),
        )  # fmt: skip
        return run["tip_y"][-1]

    f, x, h = jax.jit(final), 25.0, 1e-2
    slope = jax.jit(jax.grad(final))(x)
    np.testing.assert_allclose(jax.jit(jax.jacfwd(final))(x), slope, rtol=1e-6)
    np.testing.assert_allclose(slope, (f(x + h) - f(x - h)) / (2 * h), rtol=1e-3)
    assert abs(slope) > 1e-5
