"""The linear model in python-control: the same poles and the same gains."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import controllers as ctl
import jaxflex as jf

ARM = jf.foldager_link(modes=1)
CHANNELS = ("angle_1", "tip_deflection_1")


def test_open_loop_has_the_transfer_function_of_the_model():
    linear = jf.linearise(ARM, jnp.zeros(1), channels=CHANNELS)
    system = jf.to_control(linear)
    assert system.input_labels == ["command_1"] and system.output_labels == list(CHANNELS)
    s = 2j * np.pi * 12.0
    expected = linear.C @ jnp.linalg.solve(s * jnp.eye(len(linear.A)) - linear.A, linear.B) + linear.D
    np.testing.assert_allclose(system(s, squeeze=False), expected, rtol=1e-9)


def test_closed_loop_follows_its_reference():
    linear = jf.linearise(ARM, jnp.zeros(1), ctl.textbook_pd(ARM, jnp.zeros(1)), CHANNELS)
    system = jf.to_control(linear, closed=True)
    assert system.input_labels == ["reference_1", "reference_rate_1", "reference_acceleration_1"]
    np.testing.assert_allclose(system.dcgain()[0, 0], 1.0, rtol=1e-6)
    np.testing.assert_allclose(np.sort_complex(system.poles()), np.sort_complex(np.linalg.eigvals(linear.A)))


def test_a_batch_is_refused():
    linear = jf.linearise(ARM, jnp.zeros(1), channels=CHANNELS)
    batch = jax.tree.map(lambda m: m[None] if hasattr(m, "ndim") else m, linear)
    with pytest.raises(ValueError, match="index the batch first"):
        jf.to_control(batch)
