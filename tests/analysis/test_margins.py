import control
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from controllers import PD, Filtered, StrainRateFeedback, Sum, ZeroOrderHold, notch

REST = jnp.zeros(1)


@pytest.fixture(scope="module")
def arm():
    # a current drive: the gain around a PD loop rolls off so slowly that only filters and holds limit it
    link = jf.Link(0.4, 0.15, 0.7, damping_ratio=0.01, modes=1)
    return jf.Arm((link,), (jf.Joint(hub_inertia=5e-3, viscous_friction=1e-3),), jf.Payload(0.02))


def system(loop, joint=0):
    dt = 0 if loop.period is None else float(loop.period)
    a = np.asarray(loop.closed(joint))
    return control.ss(a, np.asarray(loop.B)[:, [joint]], -np.asarray(loop.C)[[joint]], 0, dt)


@pytest.mark.parametrize("period", [None, 2e-3])
def test_margins_are_those_of_python_control(arm, period):
    law = Filtered(PD((1.0,), (0.06,)), [notch(6.0, 2.0, 0.2, period)])
    law = law if period is None else ZeroOrderHold(law, period)
    found = jf.margins(arm, REST, law)
    loop = system(jf.cut_loop(arm, REST, law))
    if period is None:
        gains, phases, moduli, *_ = control.stability_margins(loop, returnall=True)
        ups = [g for g in gains if g > 1]
        np.testing.assert_allclose(found.gain[0], min(ups) if ups else np.inf, rtol=1e-5)
        np.testing.assert_allclose(found.phase[0], np.deg2rad(np.abs(phases).min()), rtol=1e-5)
        np.testing.assert_allclose(found.modulus[0], moduli.min(), rtol=1e-5)
    else:
        # its margins of sampled loops go by polynomials of high order; its response on a dense grid is exact
        response = loop(np.exp(1j * np.geomspace(1.0, np.pi / period, 40_000) * period))
        crossed = np.flatnonzero(np.diff(np.sign(np.abs(response) - 1)))
        np.testing.assert_allclose(found.phase[0], np.abs(np.angle(-response[crossed])).min(), atol=1e-3)
        np.testing.assert_allclose(found.modulus[0], np.abs(1 + response).min(), rtol=1e-4)


def test_a_loop_at_its_gain_margin_swings(arm):
    law = ZeroOrderHold(PD((1.0,), (0.06,)), 2e-3)
    margin = float(jf.margins(arm, REST, law).gain[0])
    assert 1 < margin < 1000
    at, beyond = (
        jf.margins(arm, REST, ZeroOrderHold(PD((k * 1.0,), (k * 0.06,)), 2e-3)).decay
        for k in (margin, 1.01 * margin)
    )
    np.testing.assert_allclose(at, 0.0, atol=1e-6)
    assert beyond < 0


def test_margins_of_two_joints_are_each_with_the_other_closed():
    joints = tuple(jf.Joint(hub_inertia=j, viscous_friction=b) for j, b in ((0.02, 0.01), (0.05, 0.03)))
    arm = jf.Arm(tuple(jf.Link(0.4, 0.15, 1.0, modes=0) for _ in range(2)), joints)
    pose, gains = jnp.array([0.0, 0.7]), (jnp.array([3.0, 1.0]), jnp.array([0.4, 0.1]))
    found = jf.margins(arm, pose, ZeroOrderHold(PD(*map(tuple, gains)), 0.01))
    for joint in range(2):
        # the gains of one joint raised by its margin put a pole on the unit circle, and further beyond it
        for more, expected in ((1.0, 0.0), (1.01, -1.0)):
            scale = jnp.ones(2).at[joint].set(more * found.gain[joint])
            law = ZeroOrderHold(PD(*(tuple(scale * g) for g in gains)), 0.01)
            decay = jf.margins(arm, pose, law).decay
            if expected:
                assert decay < 0
            else:
                np.testing.assert_allclose(decay, 0.0, atol=1e-6)


def test_gradients_of_margins_match_finite_differences_in_both_modes():
    def of(x):
        axis = jf.Arm((), (jf.Joint(hub_inertia=0.02, viscous_friction=x[3]),))
        found = jf.margins(axis, REST, ZeroOrderHold(PD((x[0],), (x[1],)), x[2]))
        return jnp.concatenate([found.gain, found.phase, found.modulus, found.decay[None]])

    x = jnp.array([2.0, 0.15, 1e-2, 0.05])
    forward, backward = jax.jit(jax.jacfwd(of))(x), jax.jit(jax.jacrev(of))(x)
    np.testing.assert_allclose(forward, backward, rtol=1e-6, atol=1e-9)
    f = jax.jit(of)
    assert np.all(np.isfinite(f(x)))
    for k in range(4):
        h = 1e-4 * x[k]
        step = jnp.zeros(4).at[k].set(h)
        np.testing.assert_allclose(forward[:, k], (f(x + step) - f(x - step)) / (2 * h), rtol=1e-4, atol=1e-7)


def test_strain_rate_feedback_damps_the_link(arm):
    pd = PD((1.0,), (0.06,))

    def ratio(gain):
        law = Sum((pd, StrainRateFeedback(gain)))
        modes = jf.closed_loop_modes(jf.linearise(arm, REST, law, ()))
        return float(modes.damping_ratio[jnp.argmax(modes.frequency)])

    assert ratio(0.02) > 1.5 * ratio(0.0) > 0


def test_a_sampled_loop_has_no_continuous_form(arm):
    with pytest.raises(ValueError, match="use cut_loop"):
        jf.linearise(arm, REST, ZeroOrderHold(PD((1.0,), (0.1,)), 1e-3))
