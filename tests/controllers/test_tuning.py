import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
import pytest

import jaxflex as jf
from controllers import (
    Delays,
    Interval,
    Move,
    Positive,
    Problem,
    Simplex,
    assess,
    classical_designs,
    cost,
    default_move,
    ringing_mode,
    stack,
    standard_start,
    textbook_pd,
    tune,
    unshaped_design,
    with_payloads,
)
from controllers.minimise import make_stepper, minimise, with_gradient


@pytest.mark.parametrize(
    "bijection, value",
    [
        (Positive(), [0.3, 20.0]),
        (Interval(jnp.array([1.0, 0.1]), jnp.array([5.0, 9.0])), [2.0, 0.5]),
        (Simplex(), [0.2, 0.5, 0.3]),
        (Delays(1.5), [0.0, 0.4, 1.1, 1.5]),
    ],
)
def test_bijections_go_there_and_back(bijection, value):
    value = jnp.asarray(value)
    np.testing.assert_allclose(bijection.value(bijection.free(value)), value, rtol=1e-9, atol=1e-12)
    free = bijection.free(value)
    far = bijection.value(free + 3.0 * jnp.sign(free + 0.1))
    assert np.all(np.isfinite(far))


def test_simplex_and_delays_cannot_leave_their_domain():
    free = jnp.array([30.0, -40.0, 5.0])
    np.testing.assert_allclose(Simplex().value(free).sum(), 1.0)
    delays = Delays(2.0).value(free)
    assert delays[0] == 0 and np.all(np.diff(delays) >= 0)
    np.testing.assert_allclose(delays[-1], 2.0)


@pytest.fixture(scope="module")
def problem():
    arm = jf.foldager_link(0.02, modes=1)
    move = default_move(arm)
    start = textbook_pd(arm, jnp.stack(move.stop), feedforward=True)
    return Problem(arm, jnp.array([0.0, 0.04]), move, start, 0.09, watch=0.3, samples=61, impulses=4)


def test_textbook_pd_is_critically_damped_for_the_rigid_arm(problem):
    arm, gains = problem.arm, problem.start
    rigid = jf.Arm(
        (jf.Link(0.395, float(arm.links[0].mass_per_length), 1.0, modes=0),),
        arm.joints,
        arm.payload,
        None,
        "voltage",
    )
    motor = jf.DCMotor(1.2, 0.062, 0.062)  # without inductance, as the rule assumes
    joint = jf.Joint(hub_inertia=1.1e-4, viscous_friction=2e-4, motor=motor)
    rigid = jf.Arm(rigid.links, (joint,), arm.payload, None, "voltage")
    modes = jf.closed_loop_modes(jf.linearise(rigid, jnp.zeros(1), gains, ()))
    third = jf.locked_frequencies(arm)[0] / 3
    np.testing.assert_allclose(modes.frequency, third, rtol=1e-4)
    np.testing.assert_allclose(modes.damping_ratio, 1.0, atol=1e-4)


def test_designs_last_equally_long(problem):
    total = float(problem.total_time())
    for design in classical_designs(problem.arm, problem.start, problem.move, total).values():
        np.testing.assert_allclose(design.move_time(), total, rtol=1e-9)
    design = problem.design(standard_start(problem))
    np.testing.assert_allclose(design.move_time(), total, rtol=1e-9)
    frequency, ratio = ringing_mode(problem.arm, jnp.stack(problem.move.stop), problem.start)
    assert float(frequency) > 0 and 0 <= float(ratio) < 0.7


def test_gradient_of_the_cost_matches_finite_differences(problem):
    free = problem.free(standard_start(problem))

    def of_free(x):
        return cost(problem, problem.values(x))

    value, slope = jax.jit(jax.value_and_grad(with_gradient(of_free)))(free)
    f = jax.jit(of_free)
    np.testing.assert_allclose(f(free), value, rtol=1e-6)
    direction = jnp.asarray(np.random.default_rng(0).normal(size=free.shape))
    h = 1e-3
    difference = (f(free + h * direction) - f(free - h * direction)) / (2 * h)
    np.testing.assert_allclose(slope @ direction, difference, rtol=2e-2)


def test_tuning_beats_the_textbook_on_payloads_it_never_saw(problem):
    seen = []
    tuned = tune(
        problem,
        standard_start(problem),
        starts=3,
        max_steps=25,
        descents=1,
        progress=lambda *a: seen.append(a),
    )
    minimum = tuned.minima[0]
    assert minimum.history[-1] < minimum.history[0] - 1.0 and minimum.steps == len(minimum.history)
    assert "converged" in minimum.reason and {what for what, _, _ in seen} == {"starts", "descent 1"}
    total = float(problem.total_time())
    untuned = unshaped_design(textbook_pd(problem.arm, jnp.stack(problem.move.stop)), problem.move, total)
    times = jnp.linspace(0.0, total + 0.3, 401)
    held_out = with_payloads(problem.arm, jnp.array([0.01, 0.03]))
    measures, runs = assess(stack([untuned, tuned.design]), held_out, times)
    runs.check()
    worst = np.asarray(measures.residual_vibration).max(axis=1)
    assert worst[1] < worst[0] / 4
    assert np.asarray(measures.peak_voltage).max() <= 24.0 + 1e-9
    assert np.asarray(measures.deflection)[1].max() < 0.13


def test_a_failing_simulation_costs_infinity_and_is_no_gradient_of_nan():
    def cliff(x):
        return jnp.where(x[0] > 2.0, jnp.inf, (x[0] - 1.9) ** 2 + x[1] ** 2)

    stepper = make_stepper(cliff, optx.BFGS(rtol=1e-8, atol=1e-8), jnp.zeros(2))
    found = minimise(stepper, jnp.array([0.0, 5.0]), 60)
    np.testing.assert_allclose(found.free, [1.9, 0.0], atol=1e-3)
    assert found.reason == "converged"
    short = minimise(stepper, jnp.array([0.0, 5.0]), 2)
    assert "2 steps allowed, not converged" in short.reason


def test_no_start_that_can_be_simulated_is_an_error(problem):
    hopeless = Problem(
        problem.arm, problem.payloads, Move((0.0,), (2000.0,), 0.01), problem.start, 0.01,
        watch=0.3, samples=61, impulses=4,
    )  # fmt: skip
    with pytest.raises(RuntimeError, match="no start of the tuning could be simulated"):
        tune(hopeless, standard_start(hopeless), starts=1, max_steps=1)
