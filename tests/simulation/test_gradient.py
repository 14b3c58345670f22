import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from controllers import OpenLoop, Sampled

TIMES = jnp.linspace(0.0, 0.3, 4)


def push(values):
    arm = jf.ahmad_arm(0.05, modes=1, drive="torque")
    torque = Sampled(jnp.linspace(0.0, 0.3, values.shape[0]), jnp.stack([values, 0.3 * values], 1), "linear")
    adjoint = jf.adjoint_for(values.shape[0])
    run = jf.simulate(
        arm, OpenLoop(), torque, TIMES, method=jf.Fixed(1e-3), channels=["tip_y"], adjoint=adjoint
    )
    return run["tip_y"][-1]


@pytest.mark.parametrize("count", [4, 40])
def test_gradient_in_the_mode_chosen_by_count(count):
    values = 0.1 * jnp.cos(jnp.arange(count) / count)
    value, gradient = jf.value_and_gradient(push)(values)
    np.testing.assert_allclose(value, push(values), rtol=1e-12)
    along, h = jnp.sin(1.0 + jnp.arange(count)), 1e-4
    slope = (push(values + h * along) - push(values - h * along)) / (2 * h)
    np.testing.assert_allclose(gradient @ along, slope, rtol=1e-6)


def test_mode_changes_with_the_count():
    assert type(jf.adjoint_for(10)) is not type(jf.adjoint_for(200))


def test_slopes_along_some_directions_are_parts_of_the_gradient():
    values = 0.1 * jnp.cos(jnp.arange(4.0))
    (value, gradient), along = jf.value_and_gradient(push)(values), jnp.eye(4)[1:3]
    found, slopes = jf.value_and_slopes(push)(values, along)
    np.testing.assert_allclose(found, value, rtol=1e-12)
    np.testing.assert_allclose(slopes, gradient[1:3], rtol=1e-9)
