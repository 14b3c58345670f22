import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from controllers import OpenLoop, Step
from jaxflex.effects import EFFECTS, CableStiffness, CoulombFriction, LoadTorqueBias

FULL = {"torque": 0.3, "stiffness": 0.4, "coefficient": 0.2, "sine": 0.1}


def make(name, size):
    kind = EFFECTS[name]
    first = next(iter(FULL.keys() & kind.__dataclass_fields__.keys()))
    return kind(**{first: size * FULL[first]})


@pytest.mark.parametrize("name", list(EFFECTS))
def test_zero_means_absent_and_gradients_are_finite_at_rest(name):
    zero, rest = jnp.zeros(()), jnp.array(0.3)
    assert make(name, 0.0)(rest, jnp.array(1.5)) == 0.0
    slopes = jax.grad(lambda s, a, v: make(name, s)(a, v), (0, 1, 2))(1.0, rest, zero)
    assert np.isfinite(slopes).all()
    assert make(name, 1.0).name == name and make(name, 1.0).joint == 0


@pytest.mark.parametrize("name", ["coulomb_friction", "stribeck_friction", "quadratic_drag"])
def test_friction_takes_energy(name):
    rates = jnp.linspace(-2.0, 2.0, 41)
    power = jax.vmap(lambda v: make(name, 1.0)(jnp.zeros(()), v) * v)(rates)
    assert np.all(np.asarray(power) <= 0) and power.min() < 0


def test_coulomb_friction_stops_an_axis_at_constant_deceleration():
    arm = jf.Arm((), (jf.Joint(hub_inertia=0.1),), effects=(CoulombFriction(0.2, transition_rate=1e-4),))
    start = jf.InitialState(rates=jnp.array([1.0]))
    times = jnp.linspace(0.0, 0.4, 21)
    run = jf.simulate(arm, OpenLoop(), Step((0.0,), (0.0,)), times, initial=start)
    np.testing.assert_allclose(run["rate_1"], 1.0 - 2.0 * times, atol=1e-5)


def test_cable_and_bias_at_rest():
    effects = (CableStiffness(2.0, rest_angle=0.1), LoadTorqueBias(0.3))
    arm = jf.Arm((), (jf.Joint(hub_inertia=0.1, viscous_friction=2.0),), effects=effects)
    run = jf.simulate(arm, OpenLoop(), Step((0.0,), (0.0,)), jnp.linspace(0.0, 30.0, 4))
    np.testing.assert_allclose(run["angle_1"][-1], 0.1 - 0.3 / 2.0, rtol=1e-5)


def test_bad_places_are_refused():
    with pytest.raises(ValueError, match="location must be joint_1"):
        CoulombFriction(0.1, location="link_1")
    with pytest.raises(ValueError, match="joint_2"):
        jf.Arm((), (jf.Joint(hub_inertia=1.0),), effects=(CoulombFriction(0.1, location="joint_2"),))
