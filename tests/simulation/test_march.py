import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from controllers import PD, BangBang, Move, OpenLoop, Shaped, Shaper, Step

ARM = jf.ahmad_arm(0.05, modes=1, drive="torque")
TIMES = jnp.linspace(0.0, 0.6, 13)
PUSH = BangBang((0.2, 0.1), width=0.2371)


def last(width, method, **options):
    push = dataclasses.replace(PUSH, width=width)
    return jf.simulate(ARM, OpenLoop(), push, TIMES, method=method, channels=["tip_y"], **options)["tip_y"][
        -1
    ]


def test_order_four_across_jumps_that_lie_on_no_grid():
    exact = last(0.2371, jf.Adaptive(rtol=1e-11, atol=1e-13))
    errors = [abs(float(last(0.2371, jf.Fixed(dt)) - exact)) for dt in (2e-3, 1e-3, 5e-4)]
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / np.array(errors[1:])), 4.0, atol=0.3)


def test_the_time_of_a_jump_has_a_derivative_in_both_modes():
    method, h = jf.Fixed(5e-4), 1e-6
    slope = (last(0.2371 + h, method) - last(0.2371 - h, method)) / (2 * h)
    assert abs(slope) > 0.01
    width = jnp.asarray(0.2371)
    np.testing.assert_allclose(jax.jit(jax.grad(lambda w: last(w, method)))(width), slope, rtol=1e-6)
    np.testing.assert_allclose(jax.jit(jax.jacfwd(lambda w: last(w, method)))(width), slope, rtol=1e-6)


@pytest.mark.parametrize("off", [0.0, 1e-16, -1e-16])
def test_a_jump_at_one_of_the_times_has_its_derivative_too(off):
    # whichever way its time and the echo of it, 0.1 and 0.1437, are rounded
    arm = jf.Arm((), (jf.Joint(hub_inertia=0.01, viscous_friction=0.02),))
    times, shaper = jnp.linspace(0.0, 0.3, 31), Shaper(jnp.array([0.6, 0.4]), jnp.array([0.0, 0.0437]))

    def angle(begin, method):
        step = Shaped(Step((0.1,), (0.3,), begin), shaper)
        return jf.simulate(arm, PD((2.0,), (0.1,)), step, times, method=method)["angle_1"][-1]

    begin = 0.1 + off
    coarse, fine = angle(begin, jf.Fixed(2e-3)), angle(begin, jf.Exact())
    np.testing.assert_allclose(coarse, fine, atol=1e-9)
    slope = (angle(begin + 1e-5, jf.Exact()) - angle(begin - 1e-5, jf.Exact())) / 2e-5
    ahead = jax.jit(jax.jacfwd(lambda b: angle(b, jf.Fixed(2e-3))))(begin)
    np.testing.assert_allclose(ahead, slope, rtol=1e-6)


def test_step_from_the_fastest_rate_is_stable_and_accurate():
    controller, move = PD((6.0, 2.0), (2.0, 0.6)), Move((0.0, 0.0), (0.8, 0.5), 0.5)
    arm = jf.ahmad_arm(0.05)
    exact = jf.simulate(arm, controller, move, TIMES, method=jf.Adaptive(rtol=1e-9, atol=1e-11))
    run = jf.simulate(arm, controller, move, TIMES, method=jf.Fixed(None))
    np.testing.assert_allclose(run["tip_y"], exact["tip_y"], atol=1e-6)
    np.testing.assert_allclose(run["voltage_1"], exact["voltage_1"], atol=1e-4)


def test_a_batch_is_the_runs_one_by_one():
    def run(width, dt):
        push = dataclasses.replace(PUSH, width=width)
        return jf.simulate(ARM, OpenLoop(), push, TIMES, method=jf.Fixed(dt), channels=["tip_y"])

    widths, steps = jnp.array([0.1, 0.2, 0.35]), jnp.array([1e-3, 5e-4, 7e-4])
    batch = jax.jit(jax.vmap(run))(widths, steps)
    for i in range(3):
        alone = run(widths[i], steps[i])
        np.testing.assert_allclose(batch["tip_y"][i], alone["tip_y"], rtol=1e-10, atol=1e-13)
        assert int(batch.steps[i]) == int(alone.steps)


def test_too_many_steps_and_too_long_steps_are_failures():
    with pytest.raises(jf.SimulationError, match="max_steps"):
        last(0.2, jf.Fixed(1e-3), max_steps=100)
    with pytest.raises(jf.SimulationError, match="diverged"):
        jf.simulate(ARM, OpenLoop(), Step((0.0, 0.0), (0.1, 0.0)), TIMES, method=jf.Fixed(0.02))
    with pytest.raises(ValueError, match="give it a step"):
        jf.simulate(ARM, OpenLoop(), PUSH, TIMES, method=jf.Fixed(None), sample_time=0.01)
