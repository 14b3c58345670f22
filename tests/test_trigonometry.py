import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

from jaxflex.trigonometry import sin_cos


@pytest.mark.parametrize("dtype, reach, allowed", [(jnp.float64, 1e6, 2.5e-16), (jnp.float32, 1e3, 1.2e-7)])
@pytest.mark.parametrize("share", [1e-9, 1e-6, 1e-3, 1.0])
def test_against_long_doubles(dtype, reach, allowed, share):
    x = np.random.default_rng(0).uniform(-share * reach, share * reach, 50_000).astype(dtype)
    s, c = jax.jit(sin_cos)(jnp.asarray(x))
    exact = x.astype(np.longdouble)
    assert s.dtype == dtype
    assert np.max(np.abs(np.asarray(s) - np.sin(exact))) < allowed
    assert np.max(np.abs(np.asarray(c) - np.cos(exact))) < allowed


def test_relative_accuracy_where_the_argument_is_reduced_least():
    x = np.random.default_rng(1).uniform(-3.0, 3.0, 50_000)
    s, c = sin_cos(jnp.asarray(x))
    exact = x.astype(np.longdouble)
    for ours, true in ((s, np.sin(exact)), (c, np.cos(exact))):
        assert np.max(np.abs(np.asarray(ours) - true) / np.spacing(np.abs(np.asarray(ours)))) < 1.6


def test_special_values():
    s, c = sin_cos(jnp.array([0.0, jnp.nan, jnp.inf, 1e300]))
    np.testing.assert_array_equal(s[:1], 0.0)
    np.testing.assert_array_equal(c[:1], 1.0)
    assert np.all(np.isnan(s[1:3])) and np.all(np.isnan(c[1:3]))
    assert abs(float(s[3])) <= 1 and abs(float(c[3])) <= 1


def test_derivatives_to_the_third_order_in_both_modes():
    def product(x):
        s, c = sin_cos(x)
        return s * c * c

    check_grads(product, (jnp.array(0.7),), order=3, modes=["fwd", "rev"])
    third = jax.vmap(jax.grad(jax.grad(jax.grad(lambda x: sin_cos(x)[0]))))(jnp.array([0.3, 2.0, -9.0]))
    np.testing.assert_allclose(third, -np.cos([0.3, 2.0, -9.0]), rtol=1e-14)


def test_program_holds_the_pair_once():
    program = str(jax.make_jaxpr(jax.vmap(sin_cos))(jnp.zeros(3)))
    assert program.count("sin_cos") == 1
