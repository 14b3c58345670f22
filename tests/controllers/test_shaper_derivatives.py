"""Gradients of shapers in the mode and in impulse times, and their work under jit and vmap."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from controllers import SHAPERS, Shaper, ei, insensitivity, on_samples, residual_ratio, si, simultaneous, zvd

H = 1e-6

MAKERS = {name: SHAPERS[name] for name in ("ZVD", "EI", "EI, 2 humps", "UM-ZVD", "cosine")} | {
    "SI": lambda f, z: si(f, z, 0.5),
    "two modes": lambda f, z: simultaneous(jnp.stack([f, 2.3 * f]), jnp.stack([z, z])),
    "sampled": lambda f, z: on_samples(zvd(f, z), 0.0131, f[None], z[None]),
}


def left(shaper):
    return residual_ratio(shaper, 1.23, 0.04)


@pytest.mark.parametrize("name", list(MAKERS))
def test_gradients_in_the_mode_against_finite_differences(name):
    @jax.jit
    def value(x):
        return left(MAKERS[name](x[0], x[1]))

    x = jnp.array([1.0, 0.06])
    difference = jnp.stack([(value(x + H * e) - value(x - H * e)) / (2 * H) for e in jnp.eye(2)])
    np.testing.assert_allclose(jax.jit(jax.jacfwd(value))(x), difference, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(jax.jit(jax.jacrev(value))(x), difference, rtol=1e-4, atol=1e-6)
    # one program for a batch gives what single calls give
    batch = x + jnp.array([[0.0, 0.0], [0.05, 0.01]])
    np.testing.assert_allclose(jax.jit(jax.vmap(value))(batch), [value(row) for row in batch], rtol=1e-9)


def test_gradients_in_amplitudes_and_impulse_times():
    shaper = ei(1.0, 0.05, humps=3)

    def value(amplitudes, delays):
        return left(Shaper(amplitudes, delays))

    parts = (shaper.amplitudes, shaper.delays)
    for argument, slope in enumerate(jax.grad(value, argnums=(0, 1))(*parts)):
        for i in range(5):
            step = [jnp.zeros(5), jnp.zeros(5)]
            step[argument] = step[argument].at[i].set(H)
            high = value(*(p + s for p, s in zip(parts, step, strict=True)))
            low = value(*(p - s for p, s in zip(parts, step, strict=True)))
            np.testing.assert_allclose(slope[i], (high - low) / (2 * H), rtol=1e-5, atol=1e-8)


def test_gradient_of_the_insensitivity():
    def value(zeta):
        return insensitivity(ei(1.0, zeta), 1.0, zeta)

    difference = (value(0.05 + H) - value(0.05 - H)) / (2 * H)
    np.testing.assert_allclose(jax.grad(value)(0.05), difference, rtol=1e-4)


def test_gradient_is_finite_where_nothing_is_left():
    slope = jax.grad(lambda f: residual_ratio(zvd(1.0), f))(1.0)
    assert np.isfinite(slope)
