"""Gradients through the simulation: finite, equal in both modes, equal to finite differences."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from controllers import PD, Move, OpenLoop, Shaped, Shaper, Step
from jaxflex.effects import CoulombFriction
from jaxflex.simulation.derivatives import both_modes

TIGHT = jf.Adaptive(rtol=1e-10, atol=1e-12)
TIMES = jnp.linspace(0.0, 0.25, 6)


def tip_of_move(payload, stiffness, delay, limit, friction):
    """Tip deflection during a shaped move of a single link, all that a user may differentiate."""
    base = jf.foldager_link(payload, modes=1)
    motor = jf.DCMotor(1.2, 0.062, 0.062, inductance=1.5e-3, voltage_limit=limit)
    joint = jf.Joint(hub_inertia=1.1e-4, viscous_friction=2e-4, motor=motor)
    effect = CoulombFriction(friction)
    arm = jf.Arm(base.links, (joint,), base.payload, None, "voltage", (effect,))
    shaper = Shaper(jnp.array([0.6, 0.4]), jnp.stack([jnp.zeros(()), delay]))
    reference = Shaped(Move((0.0,), (0.4,), 0.12), shaper)
    run = jf.simulate(arm, PD((stiffness,), (0.3,)), reference, TIMES, method=TIGHT)
    return run["tip_deflection_1"][-2:].sum() + run["angle_1"][-1]


POINTS = {
    "ordinary": (0.02, 10.0, 0.08, 24.0, 0.002),
    "zero payload": (0.0, 10.0, 0.08, 24.0, 0.002),
    "saturated on the way": (0.02, 40.0, 0.08, 3.0, 0.002),
    "no friction": (0.02, 10.0, 0.08, 24.0, 0.0),
}
forward = jax.jit(jax.jacfwd(tip_of_move, tuple(range(5))))
backward = jax.jit(jax.grad(tip_of_move, tuple(range(5))))
value = jax.jit(tip_of_move)


@pytest.mark.parametrize("name", list(POINTS))
def test_both_modes_match_finite_differences(name):
    point = tuple(jnp.asarray(x) for x in POINTS[name])
    ahead, back = forward(*point), backward(*point)
    steps = (1e-4, 1e-3, 1e-4, 1e-3, 1e-5)
    for i, h in enumerate(steps):
        up, down = list(point), list(point)
        up[i], down[i] = up[i] + h, down[i] - h
        if i == 0 and point[0] == 0:
            up2 = list(point)
            up2[0] = 2 * h
            difference = (4 * value(*up) - 3 * value(*point) - value(*up2)) / (2 * h)
        else:
            difference = (value(*up) - value(*down)) / (2 * h)
        assert np.isfinite(ahead[i]) and np.isfinite(back[i])
        scale = 2e-4 * abs(float(difference)) + 2e-6
        np.testing.assert_allclose(ahead[i], difference, atol=scale, err_msg=f"argument {i}")
        np.testing.assert_allclose(back[i], ahead[i], rtol=1e-6, atol=1e-9)


def test_at_rest_with_friction_nothing_is_nan():
    def final(torque, friction):
        arm = jf.Arm((), (jf.Joint(hub_inertia=0.01),), effects=(CoulombFriction(friction),))
        return jf.simulate(arm, OpenLoop(), Step((torque,), (torque,)), TIMES, method=TIGHT)["angle_1"][-1]

    slopes = jax.jit(jax.grad(final, (0, 1)))(0.0, 0.05)
    ahead = jax.jit(jax.jacfwd(final, (0, 1)))(0.0, 0.05)
    h = 1e-5
    difference = (final(h, 0.05) - final(-h, 0.05)) / (2 * h)
    np.testing.assert_allclose([slopes[0], ahead[0]], difference, rtol=1e-5)
    np.testing.assert_allclose([slopes[1], ahead[1]], 0.0, atol=1e-12)


def test_a_given_adjoint_is_used():
    def angle(k, adjoint):
        arm = jf.Arm((), (jf.Joint(hub_inertia=0.01),))
        run = jf.simulate(arm, PD((k,), (0.1,)), Step((0.0,), (1.0,)), TIMES, adjoint=adjoint)
        return run["angle_1"][-1]

    slope = jax.jit(jax.grad(lambda k: angle(k, diffrax.RecursiveCheckpointAdjoint())))(1.0)
    ahead = jax.jit(jax.jacfwd(lambda k: angle(k, diffrax.ForwardMode())))(1.0)
    np.testing.assert_allclose(slope, ahead, rtol=1e-8)


def test_both_modes_is_one_linear_map_under_vmap():
    f = both_modes(lambda x: (jnp.sin(x["a"]) * x["b"], 3), lambda x: (jnp.sin(x["a"]) * x["b"], 3))

    def call(a, b):
        return f({"a": a, "b": b})[0]

    a, b = jnp.linspace(0.0, 1.0, 4), jnp.linspace(1.0, 2.0, 4)
    np.testing.assert_allclose(jax.vmap(jax.grad(call))(a, b), jnp.cos(a) * b)
    np.testing.assert_allclose(jax.grad(lambda a: jax.vmap(call)(a, b).sum())(a), jnp.cos(a) * b)
    np.testing.assert_allclose(jax.jacfwd(lambda a: jax.vmap(call)(a, b))(a), jnp.diag(jnp.cos(a) * b))
    np.testing.assert_allclose(
        jax.jit(jax.jvp, static_argnums=0)(call, (a[1], b[1]), (0.0, 1.0))[1], jnp.sin(a[1])
    )


def test_second_derivatives_are_refused_not_zero():
    f = both_modes(lambda x: x**3, lambda x: x**3)
    for second in (jax.grad(jax.grad(f)), jax.jacfwd(jax.grad(f)), jax.jacfwd(jax.jacfwd(f))):
        with pytest.raises(Exception, match="cannot be autodifferentiated"):
            second(jnp.array(2.0))


def test_fastest_rate_is_that_of_the_linear_model():
    from jaxflex.simulation.plant import Plant
    from jaxflex.simulation.stiffness import fastest_rate

    for arm, gains in (
        (jf.foldager_link(0.02), PD((10.0,), (0.3,))),
        (jf.ahmad_arm(0.05), PD((3.0, 0.4), (9.0, 0.8))),
    ):
        joints = len(arm.joints)
        reference = Step((0.0,) * joints, (0.0,) * joints)
        plant = Plant(arm.assemble(), gains, reference, None, None)
        estimate = fastest_rate(jnp.zeros(()), plant.rest((jnp.zeros(()),) * joints), plant)
        poles = np.linalg.eigvals(np.asarray(jf.linearise(arm, jnp.zeros(joints), gains, ()).A))
        np.testing.assert_allclose(estimate, np.abs(poles).max(), rtol=0.25)
