import jax
import jax.numpy as jnp
import numpy as np
import scipy.signal

import jaxflex as jf

TIMES = jnp.linspace(0.0, 3.0, 31)


def test_first_and_second_order_in_closed_form():
    # k / (tau s + 1)
    first = jf.step_response(jnp.array([3.0]), jnp.array([0.5, 1.0]), TIMES)
    np.testing.assert_allclose(first, 3 * (1 - np.exp(-np.asarray(TIMES) / 0.5)), atol=1e-14)
    # w^2 / (s^2 + 2 z w s + w^2)
    w, z = 7.0, 0.1
    damped = w * np.sqrt(1 - z**2)
    t = np.asarray(TIMES)
    exact = 1 - np.exp(-z * w * t) * (np.cos(damped * t) + z * w / damped * np.sin(damped * t))
    second = jf.step_response(jnp.array([w**2]), jnp.array([1.0, 2 * z * w, w**2]), TIMES)
    np.testing.assert_allclose(second, exact, atol=1e-13)


def test_zeros_and_five_poles_against_an_integration():
    numerator, denominator = (
        np.array([2.0, -1.0, 30.0]),
        np.poly([-1.0, -2.5, -0.2 + 9j, -0.2 - 9j, -30.0]).real,
    )
    ours = jf.step_response(jnp.asarray(numerator), jnp.asarray(denominator), TIMES)
    # step_response of scipy steps with a matrix exponential: another road to the same
    _, other = scipy.signal.step((numerator, denominator), T=np.asarray(TIMES))
    np.testing.assert_allclose(ours, other, atol=1e-10 * np.abs(other).max())


def test_slope_in_a_coefficient():
    def late(damping):
        return jf.step_response(
            jnp.array([4.0]), jnp.stack([jnp.array(1.0), damping, jnp.array(4.0)]), TIMES
        )[9]

    slope = jax.jit(jax.grad(late))(0.3)
    np.testing.assert_allclose(
        slope, (late(jnp.array(0.3 + 1e-6)) - late(jnp.array(0.3 - 1e-6))) / 2e-6, rtol=1e-6
    )
