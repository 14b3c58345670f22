import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.stats
from scipy.optimize import linprog

import jaxflex as jf
from controllers import Blend, ConditionalValueAtRisk, Mean, Worst, likely, varied

COSTS = jnp.array([0.3, -1.0, 2.0, 0.7, 1.1])


@pytest.mark.parametrize("level", [0.0, 0.35, 0.6, 0.8, 0.95])
def test_conditional_value_at_risk_is_its_linear_program(level):
    # Rockafellar and Uryasev: min t + sum z / ((1 - level) n), z >= c - t, z >= 0
    n = len(COSTS)
    result = linprog(
        np.append(np.full(n, 1 / ((1 - level) * n)), 1.0),
        A_ub=np.column_stack([-np.eye(n), -np.ones(n)]), b_ub=-np.asarray(COSTS),
        bounds=[(0, None)] * n + [(None, None)],
    )  # fmt: skip
    np.testing.assert_allclose(ConditionalValueAtRisk(level)(COSTS), result.fun, rtol=1e-9)


def test_limits_of_the_aggregates():
    np.testing.assert_allclose(Worst(1e-6)(COSTS), COSTS.mean(), atol=1e-5)
    np.testing.assert_allclose(Worst(1e4)(COSTS), COSTS.max(), atol=1e-3)
    np.testing.assert_allclose(ConditionalValueAtRisk(0.999)(COSTS), COSTS.max())
    np.testing.assert_allclose(Blend(Worst(8.0), Mean(), 0.0)(COSTS), COSTS.mean())
    with pytest.raises(ValueError, match="from 0 to below 1"):
        ConditionalValueAtRisk(1.0)


@pytest.mark.parametrize("aggregate", [Mean(), Worst(), ConditionalValueAtRisk(0.7), Blend()])
def test_gradients_of_aggregates(aggregate):
    slope, h = jax.grad(aggregate)(COSTS), 1e-6
    np.testing.assert_allclose(jax.jacfwd(aggregate)(COSTS), slope, rtol=1e-9)
    np.testing.assert_allclose(slope.sum(), 1.0)  # a shift of all is a shift of the whole
    for k in range(len(COSTS)):
        step = jnp.zeros(5).at[k].set(h)
        found = (aggregate(COSTS + step) - aggregate(COSTS - step)) / (2 * h)
        np.testing.assert_allclose(slope[k], found, atol=1e-6)


def test_a_distribution_becomes_equally_likely_values():
    values = likely(scipy.stats.norm(0.05, 0.01), 200)
    np.testing.assert_allclose([values.mean(), values.std()], [0.05, 0.01], rtol=1e-2)
    np.testing.assert_allclose(likely(scipy.stats.uniform(0.0, 0.1), 5), [0.01, 0.03, 0.05, 0.07, 0.09])


def test_varied_arms_are_the_arms_with_those_parameters():
    arm = jf.foldager_link(modes=1)
    arms = varied(arm, jnp.array([0.0, 0.03]), jnp.array([1.0, 0.8]), jnp.array([1.0, 2.0]))
    frequencies = jax.vmap(jf.locked_frequencies)(arms)
    for k, (payload, factor) in enumerate(((0.0, 1.0), (0.03, 0.8))):
        expected = jf.locked_frequencies(arm.with_payload(payload)) * np.sqrt(factor)
        np.testing.assert_allclose(frequencies[k], expected, rtol=1e-6)
    np.testing.assert_allclose(arms.links[0].damping_ratio[0], [0.006, 0.012])
    with pytest.raises(ValueError, match="damping of a link is a rule"):
        varied(jf.ahmad_arm(damping="ahmad"), jnp.zeros(2), damping=jnp.ones(2))
