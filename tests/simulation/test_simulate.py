import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from controllers import PD, BangBang, Move, OpenLoop, Sampled, Step

TIGHT = jf.Adaptive(rtol=1e-10, atol=1e-12)
TIMES = jnp.linspace(0.0, 1.0, 101)
ZERO = Step((0.0, 0.0), (0.0, 0.0))


def undamped(**options):
    return jf.ahmad_arm(0.05, damping=0.0, drive="torque", **options)


def energy(arm, run):
    model = arm.assemble()

    def total(q, qd):
        return jf.kinetic_energy(model, q, qd) + jf.potential_energy(model, q)

    return np.asarray(jax.vmap(total)(run.state.q, run.state.qd))


@pytest.mark.parametrize("gravity", [None, 0.5])
def test_energy_is_conserved_without_damping_and_input(gravity):
    arm = undamped(modes=1)
    arm = jf.Arm(arm.links, arm.joints, arm.payload, gravity, "torque")
    start = jf.InitialState(
        angles=jnp.array([0.3, 0.5]), rates=jnp.array([1.0, -2.0]), deflections=jnp.array([0.01, 0.0, 0.005])
    )
    run = jf.simulate(arm, OpenLoop(), ZERO, TIMES, initial=start, method=TIGHT)
    total = energy(arm, run)
    scale = abs(total).max()
    np.testing.assert_allclose(total, total[0], atol=1e-8 * scale)


def test_energy_balance_with_motor_and_damping():
    arm = jf.foldager_link(0.02, modes=2)
    times = jnp.linspace(0.0, 0.4, 4001)
    run = jf.simulate(arm, PD((10.0,), (0.3,)), Move((0.0,), (0.5,), 0.3), times, method=TIGHT)
    model = arm.assemble()
    loss = [np.asarray(d) * np.asarray(qd) ** 2 for d, qd in zip(model.damping(), run.state.qd, strict=True)]
    power = np.asarray(run["torque_1"] * run["rate_1"]) - sum(loss)
    work = np.trapezoid(power, np.asarray(times))
    np.testing.assert_allclose(energy(arm, run)[-1], work, rtol=1e-5)


@pytest.mark.parametrize("solver, order", [(diffrax.Heun(), 2), (diffrax.Bosh3(), 3)])
def test_fixed_steps_converge_at_the_order_of_the_solver(solver, order):
    arm = undamped(modes=1)
    # the jump of the torque lies on no grid: the order survives only because it is stepped to
    reference = BangBang((0.2, 0.1), width=0.2371)
    exact = jf.simulate(arm, OpenLoop(), reference, TIMES, method=TIGHT)["tip_y"][-1]
    errors = []
    for dt in (1e-3, 5e-4, 2.5e-4):
        run = jf.simulate(arm, OpenLoop(), reference, TIMES, method=jf.Fixed(dt, solver))
        errors.append(abs(float(run["tip_y"][-1] - exact)))
    slopes = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    np.testing.assert_allclose(slopes, order, atol=0.35)


def test_stiff_solver_agrees():
    arm = jf.foldager_link(0.02, modes=1)
    times = jnp.linspace(0.0, 0.2, 21)
    args = (arm, PD((10.0,), (0.3,)), Move((0.0,), (0.5,), 0.15), times)
    explicit = jf.simulate(*args)
    stiff = jf.simulate(*args, method=jf.Adaptive(rtol=1e-7, atol=1e-9, solver=diffrax.Kvaerno5()))
    np.testing.assert_allclose(stiff["tip_y"], explicit["tip_y"], atol=1e-6)


def test_sampled_control_is_the_exact_zero_order_hold():
    # a motor axis driven by a torque is linear: x+ = Ad x + Bd u, closed form
    inertia, friction, period = 0.02, 0.05, 0.01
    arm = jf.Arm((), (jf.Joint(hub_inertia=inertia, viscous_friction=friction),))
    kp, kd = 2.0, 0.15
    times = jnp.arange(0.0, 0.5, period)
    run = jf.simulate(arm, PD((kp,), (kd,)), Step((0.0,), (1.0,)), times, sample_time=period, method=TIGHT)
    a = friction / inertia
    e = np.exp(-a * period)
    ad = np.array([[1, (1 - e) / a], [0, e]])
    bd = np.array([(period - (1 - e) / a) / friction, (1 - e) / friction])
    x, expected, torque = np.zeros(2), [], []
    for _ in times:
        u = kp * (1 - x[0]) - kd * x[1]
        expected.append(x[0])
        torque.append(u)
        x = ad @ x + bd * u
    np.testing.assert_allclose(run["angle_1"], expected, atol=1e-9)
    np.testing.assert_allclose(run["torque_1"], torque, atol=1e-8)
    between = jf.simulate(
        arm, PD((kp,), (kd,)), Step((0.0,), (1.0,)), times + 0.3 * period * (times > 0), sample_time=period,
        method=jf.Fixed(1e-3),
    )  # fmt: skip
    np.testing.assert_allclose(between["torque_1"][1:], torque[1:], atol=1e-6)


def test_sampling_fast_is_continuous_control():
    arm = jf.foldager_link(0.02, modes=1)
    times = jnp.linspace(0.0, 0.3, 31)
    args = (arm, PD((10.0,), (0.3,)), Move((0.0,), (0.5,), 0.2), times)
    continuous = jf.simulate(*args)["tip_y"]
    errors = [
        float(jnp.abs(jf.simulate(*args, sample_time=period)["tip_y"] - continuous).max())
        for period in (2e-3, 1e-3)
    ]
    np.testing.assert_allclose(errors[0] / errors[1], 2.0, rtol=0.1)


def test_initial_states_disturbance_and_saturation():
    arm = jf.Arm(
        (), (jf.Joint(hub_inertia=0.5, motor=jf.DCMotor(1.0, 0.5, 0.0, voltage_limit=2.0)),), drive="voltage"
    )
    start = jf.InitialState(angles=jnp.array([0.2]), rates=jnp.array([1.0]))
    run = jf.simulate(
        arm, OpenLoop(), Step((10.0,), (10.0,)), TIMES, initial=start, disturbance=Step((0.0,), (0.25,), 0.5)
    )
    t = np.asarray(TIMES)
    pushed = 0.5 * 2.0 * t**2 + 0.25 * np.maximum(t - 0.5, 0) ** 2
    np.testing.assert_allclose(run["angle_1"], 0.2 + t + pushed, rtol=1e-7)
    np.testing.assert_allclose(run["voltage_1"], 2.0)


def test_recorded_input_is_held():
    times = jnp.linspace(0.0, 1.0, 11)
    values = jnp.sin(7.0 * times)[:, None]
    arm = jf.Arm((), (jf.Joint(hub_inertia=1.0),))
    run = jf.simulate(arm, OpenLoop(), Sampled(times, values, "hold"), times, method=TIGHT)
    np.testing.assert_allclose(run["rate_1"][1:], 0.1 * np.cumsum(values[:-1, 0]), atol=1e-9)


def test_reference_without_jumps():
    class Still(jf.AbstractReference):
        def __call__(self, t):
            return (0.0 * t, 0.0 * t)

        def jumps(self):
            return jnp.zeros(0)

        def end(self):
            return jf.scalar(0.0)

    start = jf.InitialState(rates=jnp.array([0.1, 0.0]))
    for method in (TIGHT, jf.Fixed(1e-3)):
        smooth, stepped = (
            jf.simulate(
                jf.ahmad_arm(modes=1, drive="torque"), OpenLoop(), signal, TIMES, initial=start, method=method,
                channels=("angle_1",),
            )["angle_1"]
            for signal in (Still(), ZERO)
        )  # fmt: skip
        np.testing.assert_allclose(smooth, stepped, atol=1e-8)


def test_payload_sweep_by_vmap_and_no_retrace():
    traces = []

    @jax.jit
    def sweep(masses):
        traces.append(1)

        def one(mass):
            arm = jf.ahmad_arm(mass, modes=1)
            return jf.simulate(arm, PD((3.0, 0.4), (9.0, 0.8)), Move((0.0, 0.0), (0.4, 0.2), 1.0), TIMES)

        return jax.vmap(one)(masses)

    masses = jnp.array([0.0, 0.05, 0.1])
    runs = sweep(masses)
    again = sweep(masses + 0.01)
    assert len(traces) == 1 and again.check() is again
    single = jf.simulate(
        jf.ahmad_arm(0.05, modes=1), PD((3.0, 0.4), (9.0, 0.8)), Move((0.0, 0.0), (0.4, 0.2), 1.0), TIMES
    )
    np.testing.assert_allclose(runs["tip_y"][1], single["tip_y"], atol=1e-6)
    assert "failed" in repr(runs) and len(repr(runs)) < 500


def test_second_eager_call_does_not_retrace():
    arm = jf.Arm((), (jf.Joint(hub_inertia=1.0),))
    traces = []

    class Counting(OpenLoop):
        def command(self, t, memory, measurement, setpoint):
            traces.append(1)
            return setpoint.value

    controller = Counting()
    jf.simulate(arm, controller, Step((0.0,), (1.0,)), TIMES)
    first = len(traces)
    jf.simulate(arm, controller, Step((0.0,), (2.0,)), TIMES)
    assert first > 0 and len(traces) == first


def test_unstable_loop_is_an_error_with_its_reason():
    arm = jf.foldager_link(0.0, modes=1)
    times = jnp.linspace(0.0, 2.0, 11)
    with pytest.raises(jf.SimulationError, match="diverged"):
        jf.simulate(arm, PD((-50.0,), (-1.0,)), Step((0.0,), (0.1,)), times)
    with pytest.raises(jf.SimulationError, match="ran out of steps"):
        jf.simulate(arm, PD((5.0,), (0.1,)), Step((0.0,), (0.1,)), times, max_steps=20)


def test_bad_member_of_a_batch_is_named_and_the_others_are_kept():
    arm = jf.foldager_link(0.0, modes=1)
    times = jnp.linspace(0.0, 1.0, 11)
    gains = jnp.array([5.0, -50.0, 8.0])
    runs = eqx.filter_jit(
        eqx.filter_vmap(lambda k: jf.simulate(arm, PD((k,), (0.2,)), Step((0.0,), (0.1,)), times))
    )(gains)
    with pytest.raises(
        jf.SimulationError, match="1 of 3 simulations failed:\n  member 1: the arm diverged"
    ) as caught:
        runs.check()
    kept = caught.value.trajectory
    assert caught.value.members == [(1,)]
    assert np.isnan(kept["angle_1"][1]).all() and np.isfinite(kept["angle_1"][jnp.array([0, 2])]).all()


def test_misfits_are_refused():
    arm = jf.ahmad_arm(modes=1)
    with pytest.raises(ValueError, match="reference has 1 joint"):
        jf.simulate(arm, PD((1.0, 1.0), (1.0, 1.0)), Step((0.0,), (1.0,)), TIMES)
    with pytest.raises(ValueError, match="at least two times"):
        jf.simulate(arm, OpenLoop(), ZERO, TIMES[:1])
    with pytest.raises(ValueError, match="no 'tip_z'"):
        jf.simulate(arm, OpenLoop(), ZERO, TIMES, channels=["tip_z"])
    with pytest.raises(ValueError, match="initial angles"):
        jf.simulate(arm, OpenLoop(), ZERO, TIMES, initial=jf.InitialState(angles=jnp.zeros(3)))


def test_types_are_checked_at_run_time():
    with pytest.raises(Exception, match=r"(?i)type"):
        jf.simulate(jf.ahmad_arm(modes=1), OpenLoop(), ZERO, jnp.zeros((3, 2)))
