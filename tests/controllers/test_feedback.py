"""PID, filters, instruments and sampled control against closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

import jaxflex as jf
from controllers import (
    PD,
    PID,
    Filtered,
    Instrumented,
    Move,
    OpenLoop,
    Replayed,
    Step,
    StrainRateFeedback,
    Sum,
    ZeroOrderHold,
    notch,
)

TIGHT = jf.Adaptive(rtol=1e-9, atol=1e-12)
INERTIA, FRICTION = 0.02, 0.05
AXIS = jf.Arm((), (jf.Joint(hub_inertia=INERTIA, viscous_friction=FRICTION),))


def test_notch_has_its_closed_form_and_keeps_its_place_when_sampled():
    f = jnp.array([3.0, 11.0, 12.0, 13.0, 40.0])
    s, w = 2j * np.pi * np.asarray(f), 2 * np.pi * 12.0
    expected = (s**2 + 0.1 * 0.5 * w * s + w**2) / (s**2 + 0.5 * w * s + w**2)
    np.testing.assert_allclose(notch(12.0, 0.5, 0.1).response(f), expected, rtol=1e-12)
    np.testing.assert_allclose(notch(12.0, 0.5, 0.1).response(jnp.array([12.0])), 0.1, rtol=1e-12)
    sampled = notch(12.0, 0.5, 0.1, period=0.01)
    np.testing.assert_allclose(sampled.response(jnp.array([12.0])), 0.1, rtol=1e-9)
    # away from there the frequency is warped as the bilinear transform warps it
    warped = w / np.tan(w * 0.005) * np.tan(np.pi * np.asarray(f) * 0.01) / (2 * np.pi)
    np.testing.assert_allclose(
        sampled.response(f), notch(12.0, 0.5, 0.1).response(jnp.asarray(warped)), rtol=1e-9
    )


def test_a_notch_takes_its_frequency_out_of_a_simulated_command():
    times = jnp.linspace(0.0, 3.0, 3001)

    class Tone(jf.AbstractReference):
        def __call__(self, t):
            return (jnp.sin(2 * jnp.pi * 5.0 * t),)

        def jumps(self):
            return jnp.zeros(0)

        def end(self):
            return jf.scalar(0.0)

    last = []
    for law in (
        Filtered(OpenLoop(), [notch(5.0, 1.0)]),
        ZeroOrderHold(Filtered(OpenLoop(), [notch(5.0, 1.0, period=1e-3)]), 1e-3),
    ):
        run = jf.simulate(AXIS, law, Tone(), times, channels=["torque_1"], method=jf.Adaptive(rtol=1e-8))
        last.append(np.abs(run["torque_1"][2400:]).max())
    assert max(last) < 1e-3
    with pytest.raises(ValueError, match="sampled filter has no rate"):
        jf.simulate(AXIS, _Continuous(Filtered(OpenLoop(), [notch(5.0, period=1e-3)])), Tone(), times)


class _Continuous(ZeroOrderHold):
    """A sampled law wrongly passed off as a continuous one."""

    def __init__(self, law):
        self.law, self.interval = law, 0.0

    def period(self):
        return None


def test_integral_removes_the_error_of_a_load_and_its_command_is_the_closed_form():
    law = PID(PD((2.0,), (0.3,)), (3.0,), (100.0,))
    times = jnp.linspace(0.0, 6.0, 121)
    load = Step((0.0,), (-0.4,), 0.0)
    run = jf.simulate(AXIS, law, Step((0.0,), (1.0,)), times, disturbance=load, method=TIGHT)
    # states angle, rate, integral: x' = A x + B
    a = np.array([[0, 1, 0], [-2.0 / INERTIA, -(0.3 + FRICTION) / INERTIA, 1 / INERTIA], [-3.0, 0, 0]])
    rest = np.linalg.solve(-a, np.array([0.0, (2.0 - 0.4) / INERTIA, 3.0]))
    exact = [rest + expm(a * t) @ -rest for t in np.asarray(times)]
    np.testing.assert_allclose(run["angle_1"], np.array(exact)[:, 0], atol=1e-7)
    np.testing.assert_allclose(rest[0], 1.0)


@pytest.mark.parametrize("period", [None, 5e-3])
def test_anti_windup_keeps_the_overshoot_down(period):
    times = jnp.linspace(0.0, 12.0, 601)

    def overshoot(kind):
        law = PID(PD((2.0,), (0.4,)), (2.0,), (0.05,), anti_windup=kind)
        run = jf.simulate(AXIS, law, Step((0.0,), (3.0,)), times, sample_time=period)
        assert np.abs(run["torque_1"]).max() <= 0.05 + 1e-12
        return float(jf.overshoot(run["angle_1"], 0.0, 3.0))

    wound = overshoot("none")
    assert wound > 10.0
    assert max(overshoot("back_calculation"), overshoot("clamping")) < wound / 4


def test_pid_says_what_is_wrong():
    with pytest.raises(ValueError, match="once a joint"):
        PID(PD((1.0, 2.0), (0.1, 0.1)), (1.0,), (24.0, 24.0))
    with pytest.raises(ValueError, match="anti_windup"):
        PID(PD((1.0,), (0.1,)), (1.0,), (24.0,), anti_windup="back-calculation")


def test_a_real_drive_is_its_difference_equation():
    # encoder in counts, rate from the plain difference, torque held: x+ = Ad x + Bd u in closed form
    period, kp, kd, count = 0.01, 2.0, 0.15, 2 * np.pi / 500
    law = ZeroOrderHold(Instrumented(PD((kp,), (kd,)), count, 0.0, period), period)
    times = jnp.arange(0.0, 0.6, period)
    start = jf.InitialState(angles=jnp.array([0.3]))
    run = jf.simulate(AXIS, law, Step((0.0,), (1.0,)), times, initial=start, method=TIGHT)
    a, e = FRICTION / INERTIA, np.exp(-FRICTION / INERTIA * period)
    ad = np.array([[1, (1 - e) / a], [0, e]])
    bd = np.array([(period - (1 - e) / a) / FRICTION, (1 - e) / FRICTION])
    x, expected, torque, before = np.array([0.3, 0.0]), [], [], None
    for _ in times:
        read = np.round(x[0] / count) * count
        rate = 0.0 if before is None else (read - before) / period
        u = kp * (1 - read) - kd * rate
        before = read
        expected.append(x[0])
        torque.append(u)
        x = ad @ x + bd * u
    np.testing.assert_allclose(run["torque_1"], torque, atol=1e-8)
    np.testing.assert_allclose(run["angle_1"], expected, atol=1e-8)


def test_instruments_are_needed_once_a_joint():
    arm = jf.Arm((), (jf.Joint(hub_inertia=1.0), jf.Joint(hub_inertia=1.0)))
    law = ZeroOrderHold(Instrumented(PD((1.0, 1.0), (0.1, 0.1)), 1e-3, 0.0, 1e-2), 1e-2)
    with pytest.raises(ValueError, match="once a joint, 2 each; found 1 and 1"):
        jf.simulate(arm, law, Step((0.0, 0.0), (1.0, 1.0)), jnp.linspace(0.0, 0.1, 3))


def test_a_law_made_for_a_period_is_simulated_at_it():
    law = ZeroOrderHold(PD((2.0,), (0.15,)), 0.01)
    times = jnp.linspace(0.0, 0.2, 21)
    own = jf.simulate(AXIS, law, Step((0.0,), (1.0,)), times)
    asked = jf.simulate(AXIS, law.law, Step((0.0,), (1.0,)), times, sample_time=0.01)
    np.testing.assert_allclose(own["angle_1"], asked["angle_1"], atol=1e-12)
    with pytest.raises(ValueError, match=r"made for 0\.01 s"):
        jf.simulate(AXIS, law, Step((0.0,), (1.0,)), times, sample_time=0.02)


def test_replayed_commands_are_held_and_end():
    values = jnp.array([[1.0], [-2.0], [0.5]])
    run = jf.simulate(AXIS, Replayed(values, 0.1), Step((0.0,), (0.0,)), jnp.linspace(0.0, 0.5, 11))
    np.testing.assert_allclose(run["torque_1"], np.repeat([1.0, -2.0, 0.5, 0.0, 0.0, 0.0], 2)[:11])


def test_currents_line_up_with_their_joints():
    # a motor without inductance before one with: the second joint reads the only current that is a state
    class Read(jf.AbstractController):
        def initial(self):
            return None

        def command(self, t, memory, measurement, setpoint):
            return setpoint.value[0], 2.0 + measurement.current[1] + 0.0 * measurement.current[0]

        def rate(self, t, memory, measurement, setpoint):
            return None

    motors = jf.DCMotor(2.0, 0.1, 0.0), jf.DCMotor(2.0, 0.1, 0.0, inductance=0.1)
    arm = jf.Arm((), tuple(jf.Joint(hub_inertia=1.0, motor=m) for m in motors), drive="voltage")
    times = jnp.linspace(0.0, 0.4, 9)
    run = jf.simulate(arm, Read(), Step((0.0, 0.0), (1.0, 0.0)), times, method=TIGHT)
    # L i' = 2 + i - R i
    np.testing.assert_allclose(run["current_2"], 2.0 * (1 - np.exp(-np.asarray(times) / 0.1)), atol=1e-7)


def test_a_controller_reads_strain():
    class Strain(jf.AbstractController):
        def initial(self):
            return None

        def command(self, t, memory, measurement, setpoint):
            return (1e3 * measurement.strain[0],)

        def rate(self, t, memory, measurement, setpoint):
            return None

    arm = jf.foldager_link(0.02, modes=1)
    start = jf.InitialState(deflections=jnp.array([0.01]))
    run = jf.simulate(arm, Strain(), Step((0.0,), (0.0,)), jnp.linspace(0.0, 0.05, 11), initial=start)
    np.testing.assert_allclose(run["voltage_1"], 1e3 * run["strain_1"], rtol=1e-9)
    assert np.abs(run["strain_1"]).max() > 1e-6
    assert jf.ahmad_arm().links[0].thickness is None


def test_composed_laws_are_differentiable_in_both_modes_and_do_not_retrace():
    link = jf.Link(0.4, 0.15, 0.7, modes=1, mode_shapes="clamped_free")
    arm, traces = jf.Arm((link,), (jf.Joint(hub_inertia=5e-3),)), []
    times = jnp.linspace(0.0, 0.2, 21)

    def final(x):
        traces.append(1)
        pid = PID(PD((x[0],), (0.06,)), (x[1],), (24.0,))
        law = Filtered(Sum((pid, StrainRateFeedback(x[2]))), [notch(x[3], 0.5)])
        # a torque drive and clamped shapes: the fewest programs to compile
        run = jf.simulate(
            arm, law, Move((0.0,), (0.3,), 0.15), times, channels=["tip_y"],
            method=jf.Adaptive(rtol=1e-9, atol=1e-11),
        )  # fmt: skip
        return run["tip_y"][-1]

    x = jnp.array([1.0, 0.5, 0.01, 20.0])
    f, forward = jax.jit(final), jax.jit(jax.jacfwd(final))(x)
    np.testing.assert_allclose(jax.jit(jax.grad(final))(x), forward, rtol=1e-5, atol=1e-9)
    f(x)
    seen = len(traces)
    for k in range(4):
        h = 1e-4 * x[k]
        step = jnp.zeros(4).at[k].set(h)
        np.testing.assert_allclose(forward[k], (f(x + step) - f(x - step)) / (2 * h), rtol=1e-3, atol=1e-7)
    assert len(traces) == seen
