import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf

T = jnp.linspace(0.0, 10.0, 10001)


def test_residual_vibration_of_a_sine():
    tip = jnp.stack([1.0 + 0.03 * jnp.sin(5 * T), 2.0 + 0.04 * jnp.sin(5 * T)], axis=1)
    rest = jnp.array([1.0, 2.0])
    np.testing.assert_allclose(jf.residual_vibration(T, tip, 4.0, rest), 0.1, rtol=1e-5)
    # stopping beside the target counts as well
    np.testing.assert_allclose(
        jf.residual_vibration(T, tip * 0 + rest, 4.0, rest + jnp.array([0.3, 0.4])), 0.5, rtol=1e-6
    )
    beside = rest + jnp.array([0.3, 0.4])
    np.testing.assert_allclose(jf.residual_vibration(T, tip * 0 + rest, -1.0, beside), 0.5, rtol=1e-6)
    assert jf.residual_vibration(T, tip * 0 + rest, 4.0, rest) == 0.0
    slope = jax.grad(lambda s: jf.residual_vibration(T, rest + s * (tip - rest), 4.0, rest))
    np.testing.assert_allclose(slope(1.0), 0.1, rtol=1e-5)
    assert slope(0.0) == 0.0


def test_settling_overshoot_and_rise_of_a_second_order_step():
    zeta, omega = 0.3, 4.0
    damped = omega * np.sqrt(1 - zeta**2)
    y = 1 - jnp.exp(-zeta * omega * T) * (jnp.cos(damped * T) + zeta * omega / damped * jnp.sin(damped * T))
    np.testing.assert_allclose(
        jf.overshoot(y, 0.0, 1.0), 100 * np.exp(-np.pi * zeta / np.sqrt(1 - zeta**2)), rtol=1e-4
    )
    decay = jnp.stack([jnp.exp(-T), 0 * T], axis=1)
    np.testing.assert_allclose(jf.settling_time(T, decay, jnp.zeros(2), 0.01), np.log(100), atol=2e-3)
    first = 1 - jnp.exp(-T)
    np.testing.assert_allclose(jf.rise_time(T, first, 0.0, 1.0), np.log(9), atol=1e-4)
    assert jf.settling_time(T, decay + 1.0, jnp.zeros(2), 0.01) == np.inf
    assert jf.rise_time(T, 0.5 * first, 0.0, 1.0) == np.inf


def test_spectrum_finds_hertz_and_keeps_power():
    signal = 0.2 * jnp.sin(2 * jnp.pi * 7.3 * T)
    f, density = jf.spectrum(T, signal)
    np.testing.assert_allclose(f[jnp.argmax(density)], 7.3, atol=0.1)
    np.testing.assert_allclose(jnp.sum(density) * f[1], 0.02, rtol=1e-2)


def test_peak_and_energy():
    np.testing.assert_allclose(jf.peak(jnp.array([1.0, -3.0, 2.0])), 3.0)
    np.testing.assert_allclose(jf.electrical_energy(T, 0 * T + 2.0, 0 * T + 3.0), 60.0)


@pytest.mark.parametrize("measure", [jf.peak, lambda x: jf.overshoot(x, 0.0, 1.0)])
def test_measures_batch(measure):
    batch = jnp.stack([jnp.sin(T), jnp.cos(T)])
    np.testing.assert_allclose(jax.jit(jax.vmap(measure))(batch), [measure(row) for row in batch])
