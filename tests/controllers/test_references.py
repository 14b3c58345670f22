import jax
import jax.numpy as jnp
import numpy as np
import pytest

from controllers import BangBang, Move, Quintic, Sampled, SCurve, Shaped, Step, Trapezoid, zvd

PROFILES = {
    "quintic": Quintic(),
    "trapezoid": Trapezoid(0.2),
    "bang-bang": Trapezoid(0.5),
    "s-curve": SCurve(),
}


@pytest.mark.parametrize("name", list(PROFILES))
def test_profiles_run_from_zero_to_one_and_are_symmetric(name):
    profile = PROFILES[name]
    tau = jnp.linspace(0.0, 1.0, 1001)
    s = jax.vmap(profile)(tau)
    np.testing.assert_allclose([s[0], s[-1]], [0.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(s + s[::-1], 1.0, atol=1e-12)
    rate = np.diff(s) * 1000
    assert rate.min() > -1e-9 and np.abs(np.diff(rate)).max() < 0.011  # the rate has no jump
    np.testing.assert_allclose([rate[0], rate[-1]], 0.0, atol=0.01)


def test_known_peaks():
    tau = jnp.linspace(0.0, 1.0, 20001)
    peak_rate = {"quintic": 15 / 8, "trapezoid": 1.25, "bang-bang": 2.0, "s-curve": 2.0}
    for name, peak in peak_rate.items():
        rate = jax.vmap(jax.grad(PROFILES[name]))(tau)
        np.testing.assert_allclose(rate.max(), peak, rtol=1e-3)
    acceleration = jax.vmap(jax.grad(jax.grad(Quintic())))(tau)
    np.testing.assert_allclose(acceleration.max(), 10 / np.sqrt(3), rtol=1e-6)


def test_setpoint_is_the_derivative_in_time():
    move = Move((0.1, 0.0), (0.5, -0.3), 2.0, begin=0.5)
    t = jnp.array(1.3)
    setpoint = move.setpoint(t)
    h = 1e-4
    for j in range(2):
        values = [float(move(t + k * h)[j]) for k in (-1, 0, 1)]
        np.testing.assert_allclose(setpoint.value[j], values[1])
        np.testing.assert_allclose(setpoint.rate[j], (values[2] - values[0]) / (2 * h), rtol=1e-6)
        np.testing.assert_allclose(
            setpoint.acceleration[j], (values[2] - 2 * values[1] + values[0]) / h**2, rtol=1e-5
        )
    np.testing.assert_allclose(move(jnp.array(9.0)), (0.5, -0.3))
    assert move.end() == 2.5 and list(move.jumps()) == [0.5, 2.5]


def test_gradient_with_respect_to_a_delay_is_not_zero():
    def value(delay):
        shaper = zvd(1.0)
        shaper = type(shaper)(shaper.amplitudes, shaper.delays.at[1].set(delay))
        return Shaped(Move((0.0,), (1.0,), 1.0), shaper)(jnp.array(0.9))[0]

    h = 1e-6
    difference = (value(0.5 + h) - value(0.5 - h)) / (2 * h)
    assert abs(difference) > 0.1
    np.testing.assert_allclose(jax.grad(value)(0.5), difference, rtol=1e-6)


def test_bang_bang_and_step():
    bang = BangBang((0.2, -0.1))
    assert [float(bang(jnp.array(t))[0]) for t in (-0.1, 0.5, 1.5, 2.5)] == [0.0, 0.2, -0.2, 0.0]
    np.testing.assert_allclose(bang.jumps(), [0.0, 1.0, 2.0])
    step = Step((0.0,), (1.0,), 0.3)
    assert step(jnp.array(0.2))[0] == 0.0 and step(jnp.array(0.3))[0] == 1.0


def test_sampled_signals():
    t = jnp.linspace(0.0, 1.0, 21)
    values = jnp.sin(5 * t)[:, None]
    x = jnp.array(0.512)
    np.testing.assert_allclose(Sampled(t, values)(x)[0], np.sin(5 * 0.512), atol=1e-3)
    np.testing.assert_allclose(Sampled(t, values, "linear")(x)[0], np.interp(0.512, t, values[:, 0]))
    np.testing.assert_allclose(Sampled(t, values, "hold")(x)[0], values[10, 0])
    for kind in ("cubic", "linear", "hold"):
        np.testing.assert_allclose(Sampled(t, values, kind)(jnp.array(2.0))[0], values[-1, 0])
    with pytest.raises(ValueError, match="kind = 'best'"):
        Sampled(t, values, "best")


def test_mismatched_joints_are_refused():
    with pytest.raises(ValueError, match="start has 1 joint"):
        Move((0.0,), (1.0, 1.0), 1.0)
