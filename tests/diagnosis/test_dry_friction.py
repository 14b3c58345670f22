import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import jaxflex as jf
from jaxflex.diagnosis.dry_friction import Bristle, Stepping, dry_friction, flow, span
from jaxflex.effects import AsymmetricFriction, CoulombFriction

FRICTION, LIGHTNESS = 0.02, 500.0


@settings(max_examples=100, deadline=None)
@given(
    rate=st.floats(-3.0, 3.0),
    bend=st.floats(-1.0, 1.0),
    push=st.floats(-3.0, 3.0),
    friction=st.floats(0.0, 2.0),
    length=st.floats(1e-6, 1.0),
    width=st.floats(1e-9, 1.0),
    bristle=st.one_of(
        st.just((0.0, 0.0)), st.tuples(st.floats(1e-6, 10.0), st.one_of(st.just(0.0), st.floats(1e-6, 3.0)))
    ),
)
def test_a_span_solves_backward_euler(rate, bend, push, friction, length, width, bristle):
    presliding, damping = bristle
    given = (rate, bend, push, friction, length)
    what = Bristle(*(jnp.asarray(x) for x in (width, presliding, damping)))
    end, bent = (float(x) for x in span(*(jnp.asarray(x) for x in given), what))
    grip = bent + damping * (bent - bend) / length
    assert end == pytest.approx(
        rate + length * (push - friction * grip), rel=1e-9, abs=1e-9 * (1 + damping / length)
    )
    settling = max(abs(end), width)
    assert presliding * (bent - bend) == pytest.approx(length * (end - settling * bent), abs=1e-9)
    assert abs(bent) <= 1 + 1e-9


@settings(max_examples=60, deadline=None)
@given(rate=st.floats(-3.0, 3.0), push=st.floats(-3.0, 3.0), friction=st.floats(0.05, 2.0))
def test_without_a_bristle_sliding_and_sticking_are_exact(rate, push, friction):
    """`v' = push - friction sign(v)`: to rest, then stuck or off the other way."""
    slowing = friction - push * np.sign(rate)  # against the motion
    rests = abs(rate) / slowing if slowing > 0 and rate != 0 else (0.0 if rate == 0 else np.inf)
    if rests >= 1:
        expected = rate - np.sign(rate) * slowing
    else:
        expected = np.sign(push) * max(abs(push) - friction, 0.0) * (1 - rests)
    found = slid(rate, push, lambda v, z: jnp.asarray(friction))
    assert found == pytest.approx(expected, abs=1e-7)


def slid(rate, push, friction):
    """Rate after a unit of time of a joint that slides as it begins, without a bristle."""
    start, side, push, width, none = (jnp.asarray(float(x)) for x in (rate, np.sign(rate), push, 1e-12, 0.0))
    return float(flow(start, side, push, friction, Bristle(width, none, none))[0])


def test_friction_that_weakens_with_speed_is_followed_to_second_order():
    """`v' = p - (f - b v)`: `v = (v0 + (p - f) / b) exp(b t) - (p - f) / b`."""
    rate, push, friction, errors = 0.1, 1.1, 1.0, []
    for weakening in (0.8, 0.4, 0.2):
        steady = (push - friction) / weakening
        exact = (rate + steady) * np.exp(weakening) - steady
        errors.append(slid(rate, push, lambda v, z, b=weakening: friction - b * v) - exact)
    # spans are of a set length: an error of first order in it would halve with the rate of growth
    assert (np.log2(np.divide(errors[:-1], errors[1:])) > 1.9).all()
    assert abs(errors[-1]) < 1e-3 * exact


def swing(effects, torque, time, step, start=0.0, bend=0.0):
    """Rate of a bare axis under `torque(t)`, by steps under constant friction."""
    motor = jf.DCMotor(1.0, 0.05, 0.05)
    axis = jf.Arm((), (jf.Joint(hub_inertia=1 / LIGHTNESS, motor=motor),), drive="torque", effects=effects)
    model = axis.assemble()
    stepping = Stepping(jnp.asarray(1), jnp.asarray(2), jnp.array([LIGHTNESS]))
    h, none = jnp.asarray(step), (jnp.zeros(()),)

    def advance(carry, t):
        rate, bend = carry
        free = rate + step * LIGHTNESS * torque(t + step / 2)
        (force,), (bend,) = dry_friction(model, stepping, (rate,), (free,), (bend,), none, h)
        end = free + step * LIGHTNESS * force
        return (end, bend), end

    times = jnp.arange(round(time / step)) * step
    return np.asarray(jax.lax.scan(advance, (jnp.asarray(start), jnp.asarray(bend)), times)[1])


RIGID = (CoulombFriction(FRICTION, 1e-7),)


def test_a_sliding_joint_stops_when_it_should_and_stays():
    """`u = u0 - l T t` until `u0 / (l T)`, at any step."""
    found = swing(RIGID, lambda t: 0.0 * t, 0.3, 0.013, start=1.0, bend=1.0)
    times = 0.013 * np.arange(1, len(found) + 1)
    np.testing.assert_allclose(found, np.maximum(1 - LIGHTNESS * FRICTION * times, 0.0), atol=1e-6)


def test_a_joint_breaks_loose_above_its_friction_and_not_below():
    assert np.abs(swing(RIGID, lambda t: 0.99 * FRICTION + 0 * t, 0.1, 1e-3)).max() < 1e-6
    moved = swing(RIGID, lambda t: 1.5 * FRICTION + 0 * t, 0.1, 1e-3)
    np.testing.assert_allclose(moved[-1], 0.1 * LIGHTNESS * 0.5 * FRICTION, rtol=1e-5)


def test_friction_that_differs_with_direction_slows_each_by_its_own():
    both = (*RIGID, AsymmetricFriction(0.005, 1e-7))
    for start, friction in ((1.0, FRICTION + 0.005), (-1.0, FRICTION - 0.005)):
        found = swing(both, lambda t: 0.0 * t, 0.02, 1e-3, start, np.sign(start))
        assert abs(found[-1]) == pytest.approx(1 - 0.02 * LIGHTNESS * friction, rel=1e-6)


def test_reversals_are_followed_to_second_order():
    """Error of the rate at the end of a back-and-forth motion, against steps a hundred times as short."""

    def torque(t):
        return 0.1 * jnp.sin(40 * t + 0.3)

    exact = swing(RIGID, torque, 0.32, 1e-5)[-1]
    errors = [abs(swing(RIGID, torque, 0.32, step)[-1] - exact) for step in (4e-3, 2e-3, 1e-3)]
    assert errors[2] < errors[0] / 8
    assert errors[2] < 2e-3 * np.abs(swing(RIGID, torque, 0.32, 1e-3)).max()


@pytest.mark.parametrize("damping", [0.0, 2e-3])
def test_a_bristle_is_followed_to_first_order_of_a_part_of_a_step(damping):
    """Against an integrator of its own: pushed to and fro within and beyond what the bristle bends over."""
    bend, effects = 3e-4, (CoulombFriction(FRICTION, 1e-7, 3e-4, damping),)

    def torque(t):
        return 0.03 * np.sin(60 * t) * np.sin(7 * t)

    def slope(t, state):
        rate, z = state
        turning = (rate - abs(rate) * z) / bend
        return [LIGHTNESS * (torque(t) - FRICTION * (z + damping * turning)), turning]

    times = np.arange(1, 601) / 1000
    exact = solve_ivp(slope, (0, 0.6), [0, 0], "LSODA", times, rtol=1e-9, atol=1e-11, max_step=1e-4).y[0]
    errors = []
    for step in (1e-3, 5e-4, 2.5e-4):
        found = swing(effects, lambda t: 0.03 * jnp.sin(60 * t) * jnp.sin(7 * t), 0.6, step)
        errors.append(np.sqrt(np.mean((found[round(1e-3 / step) - 1 :: round(1e-3 / step)] - exact) ** 2)))
    assert errors[0] < 0.02 * np.std(exact)
    assert errors[2] < errors[0] / 3


def test_slopes_of_a_step_are_finite_differences():
    def end(size, start, bend, presliding, damping):
        effects = (CoulombFriction(size, 0.05, presliding, damping),)
        axis = jf.Arm((), (jf.Joint(hub_inertia=1 / LIGHTNESS),), drive="torque", effects=effects)
        stepping = Stepping(jnp.asarray(1), jnp.asarray(2), jnp.array([LIGHTNESS]))
        free = start - 0.01
        (force,), (bent,) = dry_friction(
            axis.assemble(), stepping, (start,), (free,), (bend,), (jnp.zeros(()),), jnp.asarray(2e-3)
        )
        return free + 2e-3 * LIGHTNESS * force + bent

    for start in (0.3, 0.02, 0.0, -0.004):
        point = tuple(map(jnp.asarray, (FRICTION, start, 0.4, 2e-4, 1e-3)))
        for k, size in enumerate((1e-6, 1e-6, 1e-6, 1e-9, 1e-9)):
            tangent = tuple(jnp.asarray(1.0 * (i == k)) for i in range(5))
            slope = jax.jvp(end, point, tangent)[1]
            up, down = (
                end(*(p + s * size * t for p, t in zip(point, tangent, strict=True))) for s in (1, -1)
            )
            assert float(slope) == pytest.approx(float(up - down) / (2 * size), rel=1e-4, abs=1e-6)
