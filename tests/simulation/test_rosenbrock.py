import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from controllers import PD, Move, OpenLoop, Step
from jaxflex.effects import CoulombFriction
from jaxflex.simulation import rosenbrock

TIMES = jnp.linspace(0.0, 0.6, 4)
MOVE = Move((0.0, 0.0), (0.8, 0.5), 0.5)
GAINS = PD((6.0, 2.0), (2.0, 0.6))


def last(arm, method):
    return jf.simulate(arm, GAINS, MOVE, TIMES, method=method, channels=["tip_y"])["tip_y"][-1]


def test_coefficients_fulfil_the_conditions_of_order_three():
    # Hairer and Wanner (1996), table IV.7.1, with b the weights of the stages
    b, alpha = rosenbrock._WEIGHTS, rosenbrock._ALPHA
    beta = alpha + rosenbrock._COUPLING
    one = np.ones(4)
    np.testing.assert_allclose(b @ one, 1, atol=1e-14)
    np.testing.assert_allclose(b @ beta @ one, 1 / 2, atol=1e-14)
    np.testing.assert_allclose(b @ (alpha @ one) ** 2, 1 / 3, atol=1e-14)
    np.testing.assert_allclose(b @ beta @ beta @ one, 1 / 6, atol=1e-14)
    # and of a W-method, whatever stands in for the Jacobian (Steihaug and Wolfbrandt 1979)
    np.testing.assert_allclose(b @ alpha @ one, 1 / 2, atol=1e-14)
    np.testing.assert_allclose(b @ alpha @ alpha @ one, 1 / 6, atol=1e-14)
    for mixed in (alpha @ beta, beta @ alpha):
        np.testing.assert_allclose(b @ mixed @ one, 1 / 6, atol=1e-14)


def test_order_three_where_steps_resolve_every_mode():
    arm = jf.ahmad_arm(0.05, modes=1, mode_shapes="clamped_tip_mass", drive="torque")
    exact = last(arm, jf.Fixed(2e-4))
    errors = [abs(float(last(arm, jf.Fixed(dt, jf.LinearlyImplicit())) - exact)) for dt in (2e-3, 1e-3, 5e-4)]
    assert np.all(np.log2(np.array(errors[:-1]) / np.array(errors[1:])) > 2.7), errors


def test_steps_that_no_explicit_method_survives():
    arm = jf.ahmad_arm(0.05, mode_shapes="clamped_tip_mass", drive="torque")
    exact = last(arm, jf.Fixed(2e-4))
    np.testing.assert_allclose(last(arm, jf.Fixed(8e-3, jf.LinearlyImplicit())), exact, atol=5e-5)
    with pytest.raises(jf.SimulationError):
        last(arm, jf.Fixed(8e-3))


def test_windings_are_taken_in():
    arm = jf.ahmad_arm(0.05, mode_shapes="clamped_tip_mass")
    pd, move = PD((3.0, 1.0), (1.0, 0.3)), MOVE
    exact, coarse = (
        jf.simulate(arm, pd, move, TIMES, method=m, channels=["tip_y", "current_1"])
        for m in (jf.Fixed(2e-4), jf.Fixed(4e-3, jf.LinearlyImplicit()))
    )
    np.testing.assert_allclose(coarse["tip_y"], exact["tip_y"], atol=1e-4)


def test_dry_friction_is_taken_in():
    # near rest the joint is held by 100 N m s/rad, where explicit steps of any use rattle
    arm = jf.Arm((), (jf.Joint(hub_inertia=0.02),), effects=(CoulombFriction(0.1, 1e-3),))
    exact, implicit, explicit = (
        jf.simulate(arm, PD((2.0,), (0.1,)), Move((0.0,), (0.5,), 0.3), jnp.array([0.0, 1.0]), method=m)[
            "rate_1"
        ][-1]
        for m in (jf.Fixed(1e-4), jf.Fixed(2e-3, jf.LinearlyImplicit()), jf.Fixed(2e-3))
    )
    np.testing.assert_allclose(implicit, exact, atol=1e-6)
    assert abs(explicit - exact) > 1e-3


def test_derivatives_in_both_modes():
    gains, move, times = PD((2.0,), (0.05,)), Move((0.0,), (0.4,), 0.2), TIMES[:3]

    @jax.jit
    def final(mass):
        link = jf.Link(0.4, 0.15, 0.7, modes=1, mode_shapes="clamped_free")
        arm = jf.Arm((link,), (jf.Joint(hub_inertia=5e-3),), jf.Payload(mass))
        method = jf.Fixed(2e-3, jf.LinearlyImplicit())
        return jf.simulate(arm, gains, move, times, method=method, channels=["tip_y"])["tip_y"][1]

    h, mass = 1e-5, jnp.asarray(0.02)
    slope = (final(mass + h) - final(mass - h)) / (2 * h)
    np.testing.assert_allclose(jax.jit(jax.grad(final))(mass), slope, rtol=1e-5)
    np.testing.assert_allclose(jax.jit(jax.jacfwd(final))(mass), slope, rtol=1e-5)


def test_a_step_and_continuous_control_are_needed():
    arm, zero = jf.ahmad_arm(modes=1, drive="torque"), Step((0.0, 0.0), (0.0, 0.0))
    for options in ({"method": jf.Fixed(None, jf.LinearlyImplicit())},
                    {"method": jf.Fixed(1e-3, jf.LinearlyImplicit()), "sample_time": 0.01}):  # fmt: skip
        with pytest.raises(ValueError, match="needs a step"):
            jf.simulate(arm, OpenLoop(), zero, TIMES, **options)
