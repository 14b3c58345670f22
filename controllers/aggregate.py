"""One number from many: how costs over payloads, or other scenarios, become the cost of a design."""

import dataclasses
from abc import abstractmethod

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxflex import Arm, Scalar

Costs = Float[Array, " scenarios"]


class AbstractAggregate(eqx.Module):
    """A function of the costs of all scenarios, equally likely."""

    @abstractmethod
    def __call__(self, costs: Costs) -> Scalar:
        """The cost of them together."""


class Mean(AbstractAggregate):
    """The mean."""

    def __call__(self, costs: Costs) -> Scalar:
        """`mean(c)`."""
        return jnp.mean(costs)


class Worst(AbstractAggregate):
    """A smooth maximum, from the mean (`sharpness` p to 0) to the maximum (to infinity)."""

    sharpness: float = 8.0

    def __call__(self, costs: Costs) -> Scalar:
        """`log(mean(exp(p c))) / p`."""
        p = self.sharpness
        return jax.nn.logsumexp(p * costs) / p - jnp.log(costs.shape[0]) / p


class ConditionalValueAtRisk(AbstractAggregate):
    """The mean of the worst share `1 - level` of the scenarios (Rockafellar and Uryasev 2000).

    Level 0 is the mean. Between multiples of one scenario the last counts in part.
    """

    level: float = 0.8

    def __check_init__(self):
        if not 0 <= self.level < 1:
            raise ValueError(f"ConditionalValueAtRisk: level = {self.level!r}; from 0 to below 1 is allowed.")

    def __call__(self, costs: Costs) -> Scalar:
        """`min_t t + mean(max(c - t, 0)) / (1 - level)`, by sorting."""
        tail = (1 - self.level) * costs.shape[0]
        weights = jnp.clip(tail - jnp.arange(costs.shape[0]), 0.0, 1.0)
        return jnp.sum(weights * jnp.sort(costs, descending=True)) / tail


class Blend(AbstractAggregate):
    """`share` of one aggregate, the rest of another."""

    first: AbstractAggregate = Worst()
    second: AbstractAggregate = Mean()
    share: float = 0.8

    def __call__(self, costs: Costs) -> Scalar:
        """`share first(c) + (1 - share) second(c)`."""
        return self.share * self.first(costs) + (1 - self.share) * self.second(costs)


def likely(distribution, count: int) -> Float[Array, " count"]:
    """`count` equally likely values of a distribution of SciPy, such as `scipy.stats.uniform(0, 0.1)`.

    The quantiles in the middle of `count` equal shares: a distribution of payloads as a list.
    """
    return jnp.asarray(distribution.ppf((jnp.arange(count) + 0.5) / count), dtype=jnp.result_type(float))


def varied(
    arm: Arm,
    payloads: Float[Array, " scenarios"],
    stiffness: Float[Array, " scenarios"] | None = None,
    damping: Float[Array, " scenarios"] | None = None,
) -> Arm:
    """`arm` in every scenario, batched for `vmap`: payload [kg], factors on stiffness and damping of all links.

    **Raises** `ValueError` if a factor on damping is asked of an arm whose damping is a rule.
    """
    ones = jnp.ones_like(payloads)
    if damping is not None and any(isinstance(link.damping_ratio, str) for link in arm.links):
        raise ValueError("varied: the damping of a link is a rule ('ahmad'); give it as a ratio to vary it.")

    def one(mass: Scalar, stiff: Scalar, damp: Scalar) -> Arm:
        def link_of(link):
            ratios = link.damping_ratio
            ratios = ratios if isinstance(ratios, str) else tuple(z * damp for z in ratios)
            return dataclasses.replace(
                link, flexural_rigidity=link.flexural_rigidity * stiff, damping_ratio=ratios
            )

        changed = arm.with_payload(mass)
        return eqx.tree_at(lambda a: a.links, changed, tuple(map(link_of, changed.links)))

    return eqx.filter_vmap(one)(
        payloads, ones if stiffness is None else stiffness, ones if damping is None else damping
    )
