import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
import optimistix as optx
import pytest

import jaxflex as jf
from controllers import (
    PD,
    AbstractProblem,
    Delays,
    Freely,
    Interval,
    Limits,
    Move,
    NoRinging,
    Outcome,
    Positive,
    Problem,
    Simplex,
    assess,
    classical_designs,
    default_move,
    pareto_front,
    ringing_mode,
    stack,
    standard_start,
    textbook_pd,
    tune,
    unshaped_design,
    varied,
)
from controllers.judge import TOGETHER, groups, judge
from controllers.minimise import Stepper, minimise
from controllers.pareto import at_pace
from controllers.tuning import lagrangian
from jaxflex import margins

pytestmark = pytest.mark.optimised


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
    first = standard_start(problem)
    free = problem.free(first)

    def of_free(x, args):
        found = problem.outcome(problem.values(x, first))
        return found.cost, found.excess

    judged = jf.value_and_gradient(lambda x: of_free(x, None), has_aux=True)
    (value, excess), slope = jax.jit(judged)(free)
    f = jax.jit(lambda x: of_free(x, None)[0])
    np.testing.assert_allclose(f(free), value, rtol=1e-6)
    assert set(excess) == {"voltage_1", "deflection_1"}
    direction = jnp.asarray(np.random.default_rng(0).normal(size=free.shape))
    h = 1e-3
    difference = (f(free + h * direction) - f(free - h * direction)) / (2 * h)
    np.testing.assert_allclose(slope @ direction, difference, rtol=2e-2)


def test_tuning_beats_the_textbook_on_arms_it_never_saw(problem):
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
    assert tuned.evaluations == 3 + minimum.steps and tuned.measures["residual_vibration"].shape == (2,)
    total = float(problem.total_time())
    untuned = unshaped_design(textbook_pd(problem.arm, jnp.stack(problem.move.stop)), problem.move, total)
    times = jnp.linspace(0.0, total + 0.3, 401)
    # payloads between those tuned on, stiffness and damping that were not varied at all
    held_out = varied(
        problem.arm, jnp.array([0.01, 0.03, 0.02, 0.02]), jnp.array([1.0, 1.0, 0.95, 1.05]),
        jnp.array([1.0, 1.0, 0.5, 2.0]),
    )  # fmt: skip
    measures, runs = assess(stack([untuned, problem.design(tuned.values)]), held_out, times)
    runs.check()
    residual = np.asarray(measures.residual_vibration)
    assert residual[1, :2].max() < residual[0, :2].max() / 4
    assert residual[1].max() < residual[0].max() / 2
    assert np.asarray(measures.peak_voltage).max() <= 24.0 + 1e-9
    assert np.asarray(measures.deflection)[1].max() < 0.13


class Bowl(AbstractProblem):
    """Least at (3, 1) without its constraint, and known in closed form with it."""

    weight: jax.Array

    def domains(self):
        return {"a": Positive(), "b": Positive()}

    def outcome(self, values):
        a, b = values["a"], values["b"]["deep"][0]
        cost = self.weight * (a - 3.0) ** 2 + (b - 1.0) ** 2
        return Outcome(cost, {"sum": (a + b - 2.0)[None]}, {"a": a})


START = {"a": jnp.array(1.0), "b": {"deep": [jnp.array(0.5)]}}


@pytest.mark.parametrize("together", [1, 3])
def test_constraints_are_met_by_the_augmented_lagrangian(together):
    # on a + b = 2 the least of w (a-3)^2 + (b-1)^2 is at a = (1 + 3 w) / (1 + w)... within b > 0
    weight = 0.5
    tuned = tune(
        Bowl(jnp.array(weight)), START, starts=3, descents=3, max_steps=120, rounds=6, penalty=2.0,
        together=together,
    )  # fmt: skip
    a = (1 + 3 * weight) / (1 + weight)
    np.testing.assert_allclose(tuned.values["a"], a, rtol=5e-3)
    np.testing.assert_allclose(tuned.values["b"]["deep"][0], 2 - a, rtol=2e-2)
    assert tuned.excess < 1e-2 and len(tuned.minima) == 3
    np.testing.assert_allclose(tuned.cost, weight * (a - 3) ** 2 + (1 - a) ** 2, rtol=2e-2)
    # one round is a penalty: it gives way
    soft = tune(Bowl(jnp.array(weight)), START, starts=1, descents=1, max_steps=60, penalty=2.0)
    assert soft.excess > 0.05


def test_a_second_problem_of_the_same_kind_does_not_compile_again():
    traces = []

    class Counted(AbstractProblem):
        target: jax.Array

        def domains(self):
            return Positive()

        def outcome(self, values):
            traces.append(1)
            return Outcome(jnp.sum((values - self.target) ** 2))

    for target in (1.5, 2.5):
        tuned = tune(Counted(jnp.array([target])), jnp.array([1.0]), starts=2, descents=1)
        np.testing.assert_allclose(tuned.values, target, rtol=1e-3)
        if target == 1.5:
            seen = len(traces)
    assert len(traces) - seen <= 1  # the shape of its outcome is asked once, nothing is compiled


def test_any_parameters_any_objective(problem):
    # the textbook PD itself as the pytree, its gains all positive, judged by the margins of its loop
    pd = textbook_pd(problem.arm, jnp.stack(problem.move.stop))

    def judge(gains):
        found = margins(problem.arm, jnp.stack(problem.move.stop), gains)
        return Outcome(-found.decay, {"modulus": 0.5 / found.modulus - 1})

    pd = PD(pd.stiffness, (0.05,), (1e-3,), (1e-3,))
    tuned = tune(Freely(judge, Positive()), pd, starts=1, descents=1, max_steps=60, rounds=3, penalty=10.0)
    before, after = (margins(problem.arm, jnp.stack(problem.move.stop), g) for g in (pd, tuned.values))
    assert isinstance(tuned.values, PD)
    assert after.decay > before.decay and after.modulus[0] > 0.49


def test_margins_are_hard_constraints_of_the_task(problem):
    first = standard_start(problem)
    limited = Problem(
        problem.arm, problem.payloads, problem.move, problem.start, 0.09, watch=0.3, samples=61, impulses=4,
        limits=Limits(current=3.0, move_time=1.0, phase=0.5, modulus=0.6),
    )  # fmt: skip
    excess = eqx.filter_jit(limited.outcome)(first).excess
    assert set(excess) == {
        "voltage_1", "current_1", "deflection_1", "decay", "phase", "modulus", "move_time",
    }  # fmt: skip
    for payload, found in zip(limited.payloads, excess["modulus"], strict=True):
        design = limited.design(first)
        arm = limited.arm.with_payload(payload)
        expected = margins(arm, jnp.stack(design.move.stop), design.controller)
        np.testing.assert_allclose(found[0], 0.6 / expected.modulus[0] - 1, rtol=1e-6)
    np.testing.assert_allclose(excess["move_time"], limited.total_time() / 1.0 - 1, rtol=1e-9)


def cliff(x, args):
    return jnp.where(x[0] > 2.0, jnp.inf, (x[0] - 1.9) ** 2 + x[1] ** 2), x[0]


def test_a_failing_simulation_costs_infinity_and_is_no_gradient_of_nan():
    stepper = Stepper(cliff, optx.BFGS(rtol=1e-8, atol=1e-8))
    found, other = minimise(stepper, jnp.array([[0.0, 5.0], [1.0, 1.0]]), 60)
    np.testing.assert_allclose(found.free, [1.9, 0.0], atol=1e-3)
    np.testing.assert_allclose(found.aux, found.free[0])
    assert found.reason == other.reason == "converged"
    (short,) = minimise(stepper, jnp.array([[0.0, 5.0]]), 2)
    assert "2 steps allowed, not converged" in short.reason


def test_minimisers_of_optax_serve_as_well():
    def bowl(x, args):
        return (x[0] - 1.9) ** 2 + x[1] ** 2, x[0]

    stepper = Stepper(bowl, optx.OptaxMinimiser(optax.adam(0.1), rtol=1e-6, atol=1e-6))
    (found,) = minimise(stepper, jnp.array([[0.5, 2.0]]), 400)
    np.testing.assert_allclose(found.free, [1.9, 0.0], atol=2e-2)
    # the cost is that of the point, not of the one before or after it
    np.testing.assert_allclose([found.cost, found.aux], [bowl(found.free, None)[0], found.free[0]], rtol=1e-9)
    with pytest.raises(TypeError, match="does not say what its points cost"):
        minimise(Stepper(bowl, optx.NelderMead(1e-6, 1e-6)), jnp.array([[0.5, 2.0]]), 5)


def test_no_start_that_can_be_simulated_is_an_error(problem):
    hopeless = Problem(
        problem.arm, problem.payloads, Move((0.0,), (2000.0,), 0.01), problem.start, 0.01,
        watch=0.3, samples=61, impulses=4,
    )  # fmt: skip
    with pytest.raises(RuntimeError, match="no start of the tuning could be simulated"):
        tune(hopeless, standard_start(hopeless), starts=1, max_steps=1)


def test_no_ringing_leaves_the_classical_designs_out():
    rigid = jf.Arm((), (jf.Joint(hub_inertia=1.0, viscous_friction=3.0),))
    gains = PD((1.0,), (0.1,))
    with pytest.raises(NoRinging, match="nothing to cancel"):
        ringing_mode(rigid, jnp.zeros(1), gains)
    assert classical_designs(rigid, gains, Move((0.0,), (1.0,), 1.0), 2.0) == {}


def test_slower_moves_leave_less_vibration(problem):
    total = float(problem.total_time())
    front = pareto_front(problem, np.array([total, 0.8 * total]), starts=1, descents=1, max_steps=12)
    assert np.all(np.diff(front.move_time) > 0) and front.residual_vibration[1] < front.residual_vibration[0]
    assert front.efficient.tolist() == [True, True]
    designs = [
        at_pace(problem, float(t) / total).design(x.values)
        for t, x in zip(front.move_time, front.tuned, strict=True)
    ]
    np.testing.assert_allclose([d.move_time() for d in designs], front.move_time, rtol=1e-9)


@pytest.mark.parametrize(
    "minimiser",
    [
        optx.BFGS(rtol=1e-8, atol=1e-8),
        optx.NonlinearCG(rtol=1e-8, atol=1e-8),
        optx.OptaxMinimiser(optax.lbfgs(), rtol=1e-8, atol=1e-8),
    ],
    ids=["one point a step", "conjugate gradients", "a line search"],
)
def test_minimisers_are_told_the_cost_of_the_point_they_ask_for(minimiser):
    def valley(x, args):
        cost = (1 - x[0]) ** 2 + 10 * (x[1] - x[0] ** 2) ** 2
        return cost, {"count": jnp.sum(x < 100.0), "cost": cost}

    (found,) = minimise(Stepper(valley, minimiser), jnp.asarray([[-0.5, 0.6]]), 400)
    assert found.cost < 1e-5
    assert found.aux["count"] == 2 and found.aux["cost"] == pytest.approx(found.cost)


@pytest.mark.parametrize("count", [1, TOGETHER, TOGETHER + 1, 13, 3 * TOGETHER])
def test_groups_hold_every_direction_once(count):
    found = groups(count, np.dtype(float))
    assert found.shape[1] <= TOGETHER
    rows = found.reshape(-1, count)
    np.testing.assert_array_equal(rows[:count], np.eye(count))
    assert not rows[count:].any() and len(rows) - count < len(found)


@pytest.mark.parametrize("starts", [1, 3])
@pytest.mark.parametrize("count", [1, 8, 13, 24, 30])  # 30: backwards
def test_gradients_in_groups_are_those_of_the_cost(count, starts):
    def waves(x, args):
        rate, phase = args
        cost = jnp.sum(jnp.sin(rate * x + phase)) * jnp.prod(1 + 0.1 * x)
        return cost, {"last": x[-1], "calm": jnp.sum(x < 0)}

    points = jax.random.normal(jax.random.key(count), (starts, count))
    rate, phases = jnp.asarray(1.5), jnp.arange(float(starts))
    found = judge(waves, points, rate, phases)
    for i, (x, phase) in enumerate(zip(points, phases, strict=True)):
        cost, aux = waves(x, (rate, phase))
        np.testing.assert_allclose(found.cost[i], cost, rtol=1e-12)
        np.testing.assert_allclose(
            found.gradient[i], jax.grad(waves, has_aux=True)(x, (rate, phase))[0], rtol=1e-9
        )
        assert found.aux["last"][i] == aux["last"] and found.aux["calm"][i] == aux["calm"]


def test_gradient_of_a_tuning_is_the_same_in_groups_and_in_one(problem):
    first = standard_start(problem)
    free = problem.free(first)
    assert TOGETHER < free.shape[0] < 2 * TOGETHER and free.shape[0] % 2 == 0
    args, own = (problem, first), (jnp.zeros((1, 1)), jnp.full(1, 600.0))
    found = judge(lagrangian, free[None], args, own)
    alone = jf.value_and_gradient(lambda x: lagrangian(x, (args, (own[0][0], own[1][0]))), has_aux=True)
    (cost, (_, row, _)), gradient = jax.jit(alone)(free)
    np.testing.assert_allclose(found.cost, cost[None], rtol=1e-9)
    np.testing.assert_allclose(found.aux[1], row[None], rtol=1e-8)
    np.testing.assert_allclose(found.gradient, gradient[None], rtol=1e-6, atol=1e-8)
