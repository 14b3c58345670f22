"""Bijections from all of R^n to the domain of a parameter, so that a minimiser cannot leave it."""

from abc import abstractmethod

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxflex import Scalar, scalar

Free = Float[Array, " free"]
Value = Float[Array, " value"]


class AbstractBijection(eqx.Module):
    """A smooth one-to-one map from unconstrained vectors to the values of a parameter."""

    @abstractmethod
    def value(self, free: Free) -> Value:
        """The parameter that `free` stands for."""

    @abstractmethod
    def free(self, value: Value) -> Free:
        """The unconstrained vector that stands for `value`."""


class Positive(AbstractBijection):
    """Positive numbers, by the exponential."""

    def value(self, free: Free) -> Value:
        """`exp(free)`."""
        return jnp.exp(free)

    def free(self, value: Value) -> Free:
        """`log(value)`; zero counts as 1e-9."""
        return jnp.log(jnp.maximum(value, 1e-9))


class Interval(AbstractBijection):
    """Positive numbers between `low` and `high`, by a sigmoid of their logarithm."""

    low: Value
    high: Value

    def value(self, free: Free) -> Value:
        """`low (high / low)^sigmoid(free)`."""
        return self.low * (self.high / self.low) ** jax.nn.sigmoid(free)

    def free(self, value: Value) -> Free:
        """Inverse of `value`; a value on the edge is drawn in by a thousandth."""
        share = jnp.log(value / self.low) / jnp.log(self.high / self.low)
        share = jnp.clip(share, 1e-3, 1 - 1e-3)
        return jnp.log(share) - jnp.log1p(-share)


class Simplex(AbstractBijection):
    """Positive numbers that sum to one, such as the amplitudes of a shaper: a softmax, last logit zero."""

    def value(self, free: Free) -> Value:
        """`softmax([free, 0])`, one entry longer than `free`."""
        return jax.nn.softmax(jnp.append(free, 0.0))

    def free(self, value: Value) -> Free:
        """Logarithms relative to the last entry; zeros count as 1e-6."""
        logits = jnp.log(jnp.maximum(value, 1e-6))
        return logits[:-1] - logits[-1]


class Delays(AbstractBijection):
    """Ascending times from 0 to `duration` [s], both ends fixed, such as the delays of a shaper."""

    duration: Scalar = eqx.field(converter=scalar)

    def value(self, free: Free) -> Value:
        """Cumulative sum of a softmax of `[free, 0]`, times `duration`; two entries longer than `free`."""
        gaps = jax.nn.softmax(jnp.append(free, 0.0))
        return self.duration * jnp.concatenate([jnp.zeros(1), jnp.cumsum(gaps)])

    def free(self, value: Value) -> Free:
        """Logarithms of the gaps relative to the last; empty gaps count as 1e-4 of the duration."""
        logits = jnp.log(jnp.maximum(jnp.diff(value) / self.duration, 1e-4))
        return logits[:-1] - logits[-1]
