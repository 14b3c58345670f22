"""LQR, Kalman filter and LQG against python-control, SciPy and each other."""

import control
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from controllers import Move, ZeroOrderHold, kalman_gain, lqg, lqr_gain, solve_care, solve_dare

REST = jnp.zeros(1)
COST = {"angle_1": 0.01, "tip_deflection_1": 0.002}
SENSORS = {"angle_1": 1e-4, "curvature_1": 1e-3}


@pytest.fixture(scope="module")
def arm():
    return jf.foldager_link(0.02, modes=1)


@pytest.fixture(scope="module")
def linear(arm):
    return jf.linearise(arm, REST, channels=("angle_1", "curvature_1"))


def test_gains_are_those_of_python_control(linear):
    a, b, c = linear.A, linear.B, linear.C
    q, r, v = jnp.diag(jnp.arange(1.0, len(a) + 1)), jnp.array([[0.5]]), jnp.diag(jnp.array([0.1, 0.2]))
    np.testing.assert_allclose(lqr_gain(a, b, q, r), control.lqr(a, b, q, r)[0], rtol=1e-6)
    np.testing.assert_allclose(kalman_gain(a, c, q, v), control.lqe(a, np.eye(len(a)), c, q, v)[0], rtol=1e-6)
    h = jf.scalar(2e-3)
    ad, bd = jf.held(a, b, h)
    exact = control.sample_system(control.ss(a, b, c, 0), float(h), "zoh")
    np.testing.assert_allclose(ad, exact.A, atol=1e-9 * np.abs(ad).max())
    np.testing.assert_allclose(bd, exact.B, atol=1e-9 * np.abs(bd).max())
    np.testing.assert_allclose(lqr_gain(ad, bd, q, r, h), control.dlqr(ad, bd, q, r)[0], rtol=1e-6)
    np.testing.assert_allclose(
        kalman_gain(ad, c, q, v, h), control.dlqe(ad, np.eye(len(a)), c, q, v)[0], rtol=1e-6
    )


@pytest.mark.parametrize("solve", [solve_care, solve_dare])
def test_riccati_gradients_match_finite_differences_in_both_modes(solve):
    rng = np.random.default_rng(0)
    a, b = jnp.asarray(0.4 * rng.normal(size=(4, 4))), jnp.asarray(rng.normal(size=(4, 2)))

    def of(x):
        half = jnp.eye(4) + x[0] * jnp.asarray(rng_q)
        r = jnp.diag(jnp.array([1.0, 2.0])) + x[1] * jnp.array([[0.1, 0.2], [0.2, 0.5]])
        return solve(a + x[2] * jnp.asarray(rng_a), b + x[3] * jnp.asarray(rng_b), half @ half.T, r)

    rng_q, rng_a, rng_b = rng.normal(size=(4, 4)), rng.normal(size=(4, 4)), rng.normal(size=(4, 2))
    x = jnp.full(4, 0.1)
    forward, backward = jax.jit(jax.jacfwd(of))(x), jax.jit(jax.jacrev(of))(x)
    np.testing.assert_allclose(forward, backward, rtol=1e-8, atol=1e-10)
    h = 1e-5
    for k in range(4):
        step = jnp.zeros(4).at[k].set(h)
        np.testing.assert_allclose(
            forward[..., k], (of(x + step) - of(x - step)) / (2 * h), rtol=1e-5, atol=1e-7
        )
    batched = jax.vmap(lambda s: of(s * x))(jnp.array([0.5, 1.0]))
    np.testing.assert_allclose(batched[1], of(x), rtol=1e-9)


def test_no_stabilising_solution_is_an_error():
    with pytest.raises(Exception, match="no stabilising solution"):
        # the first state grows and no input reaches it
        jax.block_until_ready(
            solve_care(jnp.diag(jnp.array([1.0, -1.0])), jnp.array([[0.0], [1.0]]), jnp.eye(2), jnp.eye(1))
        )


@pytest.mark.parametrize("period", [None, 2e-3])
def test_separation_principle(arm, period):
    law = lqg(arm, REST, COST, 10.0, SENSORS, 0.1, period)
    loop = jf.cut_loop(arm, REST, law)
    whole = np.linalg.eigvals(np.asarray(loop.closed()))
    control_poles = np.linalg.eigvals(np.asarray(law.A - law.B @ law.feedback))
    filter_poles = np.linalg.eigvals(np.asarray(law.A - law.observer @ law.C))
    expected = np.concatenate([control_poles, filter_poles])
    scale = np.abs(expected).max()
    for pole in expected:
        assert np.abs(whole - pole).min() < 1e-6 * scale
    for pole in whole:
        assert np.abs(expected - pole).min() < 1e-6 * scale


@pytest.mark.parametrize("period", [None, 2e-3])
def test_lqg_moves_the_arm_and_leaves_it_quiet(arm, period):
    law = lqg(arm, jnp.array([0.5]), COST, 10.0, SENSORS, 0.1, period)
    times = jnp.linspace(0.0, 1.0, 201)
    run = jf.simulate(arm, law, Move((0.0,), (0.5,), 0.5), times)
    error = np.abs(np.asarray(run["angle_1"] - run["reference_1"]))
    assert error.max() < 1e-2 and error[-1] < 1e-4
    assert np.abs(run["tip_deflection_1"][150:]).max() < 1e-4


def test_a_slow_reference_is_followed_by_the_path_alone(arm):
    from controllers.lqg import following

    linear = jf.linearise(arm, REST, channels=("angle_1",))
    path = following(linear)
    for order in range(3):
        before = jnp.zeros(len(linear.A)) if order == 0 else path.state[:, order - 1]
        np.testing.assert_allclose(
            linear.A @ path.state[:, order] + linear.B @ path.command[:, order], before, atol=1e-8
        )
    # an acceleration bends the link as its rigid inertia forces do, statically
    tip = jf.linearise(arm, REST, channels=("tip_deflection_1",)).C[0]
    link = arm.links[0]
    mass, l, flexural = float(link.mass_per_length), float(link.length), float(link.flexural_rigidity)
    statics = -(11 / 120 * mass * l**5 + 0.02 * l**4 / 3) / flexural
    np.testing.assert_allclose(tip @ path.state[:, 2], statics, rtol=0.02)


def test_lqg_is_differentiable_in_what_it_is_designed_for(arm):
    def of(x):
        law = lqg(arm, REST, {"angle_1": x[0]}, x[1], {"angle_1": 1e-4}, x[2], 2e-3)
        return jf.margins(arm, REST, law).modulus[0]

    x = jnp.array([0.01, 10.0, 0.1])
    slope = jax.jit(jax.grad(of))(x)
    f = jax.jit(of)
    for k in range(3):
        step = jnp.zeros(3).at[k].set(1e-4 * x[k])
        np.testing.assert_allclose(
            slope[k], (f(x + step) - f(x - step)) / (2e-4 * x[k]), rtol=1e-3, atol=1e-6
        )


def test_mistakes_are_named(arm):
    with pytest.raises(ValueError, match="'voltage_1' cannot be read"):
        lqg(arm, REST, COST, 10.0, {"voltage_1": 1.0}, 0.1)
    law = lqg(arm, REST, COST, 10.0, SENSORS, 0.1)
    with pytest.raises(ValueError, match="period="):
        jf.simulate(arm, ZeroOrderHold(law, 1e-3), Move((0.0,), (0.5,), 0.5), jnp.linspace(0.0, 0.1, 3))
