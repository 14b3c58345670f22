import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import jaxflex as jf
from jaxflex.diagnosis.dry_friction import Stepping, dry_friction, flow
from jaxflex.effects import AsymmetricFriction, CoulombFriction

FRICTION, LIGHTNESS = 0.02, 500.0


@settings(max_examples=60, deadline=None)
@given(
    rate=st.floats(-3.0, 3.0),
    push=st.floats(-3.0, 3.0),
    friction=st.floats(0.05, 2.0),
    width=st.floats(0.02, 1.0),
)
def test_the_closed_form_is_the_solution_of_its_equation(rate, push, friction, width):
    def slope(_, v):
        return push - friction * np.clip(v / width, -1, 1)

    expected = solve_ivp(slope, (0, 1), [rate], rtol=1e-9, atol=1e-10, max_step=0.01).y[0, -1]
    found = flow(*(jnp.asarray(v) for v in (rate, push, friction, width)))
    assert float(found) == pytest.approx(expected, abs=1e-6)


def slide(torque, time, step, start=0.0, effects=None):
    """Rate of a bare axis under `torque(t)`, by steps under constant friction."""
    effects = effects or (CoulombFriction(FRICTION, 1e-7),)
    motor = jf.DCMotor(1.0, 0.05, 0.05)
    axis = jf.Arm((), (jf.Joint(hub_inertia=1 / LIGHTNESS, motor=motor),), drive="torque", effects=effects)
    model = axis.assemble()
    stepping = Stepping(jnp.asarray(1), jnp.asarray(2), jnp.array([LIGHTNESS]))
    h = jnp.asarray(step)

    def advance(rate, t):
        free = rate + step * LIGHTNESS * torque(t + step / 2)
        (force,) = dry_friction(model, stepping, (rate,), (free,), (jnp.zeros(()),), h)
        end = free + step * LIGHTNESS * force
        return end, end

    return np.asarray(jax.lax.scan(advance, jnp.asarray(start), jnp.arange(round(time / step)) * step)[1])


def test_a_sliding_joint_stops_when_it_should_and_stays():
    """`u = u0 - l T t` until `u0 / (l T)`, at any step."""
    found = slide(lambda t: 0.0 * t, 0.3, 0.013, start=1.0)
    times = 0.013 * np.arange(1, len(found) + 1)
    np.testing.assert_allclose(found, np.maximum(1 - LIGHTNESS * FRICTION * times, 0.0), atol=1e-6)


def test_a_joint_breaks_loose_above_its_friction_and_not_below():
    assert np.abs(slide(lambda t: 0.99 * FRICTION + 0 * t, 0.1, 1e-3)).max() < 1e-6
    moved = slide(lambda t: 1.5 * FRICTION + 0 * t, 0.1, 1e-3)
    np.testing.assert_allclose(moved[-1], 0.1 * LIGHTNESS * 0.5 * FRICTION, rtol=1e-5)


def test_friction_that_differs_with_direction_slows_each_by_its_own():
    both = (CoulombFriction(FRICTION, 1e-7), AsymmetricFriction(0.005, 1e-7))
    for start, friction in ((1.0, FRICTION + 0.005), (-1.0, FRICTION - 0.005)):
        found = slide(lambda t: 0.0 * t, 0.02, 1e-3, start, both)
        assert abs(found[-1]) == pytest.approx(1 - 0.02 * LIGHTNESS * friction, rel=1e-6)


def test_reversals_are_followed_to_second_order():
    """Error of the rate at the end of a back-and-forth motion, against steps a hundred times as short."""

    def torque(t):
        return 0.1 * jnp.sin(40 * t + 0.3)

    exact = slide(torque, 0.32, 1e-5)[-1]
    errors = [abs(slide(torque, 0.32, step)[-1] - exact) for step in (4e-3, 2e-3, 1e-3)]
    assert errors[2] < errors[0] / 8
    assert errors[2] < 2e-3 * np.abs(slide(torque, 0.32, 1e-3)).max()


def test_slopes_of_a_step_are_finite_differences():
    def end(size, start):
        effects = (CoulombFriction(size, 0.05),)
        axis = jf.Arm((), (jf.Joint(hub_inertia=1 / LIGHTNESS),), drive="torque", effects=effects)
        stepping = Stepping(jnp.asarray(1), jnp.asarray(2), jnp.array([LIGHTNESS]))
        free = start - 0.01
        (force,) = dry_friction(
            axis.assemble(), stepping, (start,), (free,), (jnp.zeros(()),), jnp.asarray(2e-3)
        )
        return free + 2e-3 * LIGHTNESS * force

    for start in (0.3, 0.02, 0.0, -0.004):
        point = (jnp.asarray(FRICTION), jnp.asarray(start))
        for k in range(2):
            tangent = tuple(jnp.asarray(1.0 * (i == k)) for i in range(2))
            slope = jax.jvp(end, point, tangent)[1]
            up, down = (
                end(*(p + s * 1e-6 * t for p, t in zip(point, tangent, strict=True))) for s in (1, -1)
            )
            assert float(slope) == pytest.approx(float(up - down) / 2e-6, rel=1e-4, abs=1e-6)
