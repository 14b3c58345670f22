"""Dry friction over a step of the integration.

It is too stiff for explicit steps, and jumps where implicit ones want a slope. But over a
step all other forces are as good as constant, and what is left are two unknowns, the rate
and the bristle. Backward Euler in these is a quadratic equation, stable at any step and for
any bristle, down to none (Moreau's time stepping); the step is cut where the joint turns.
The mean of the friction on the way acts in the step as a constant torque.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..arm.arm import AssembledArm
from ..drive import joint_effects
from ..effects import AbstractDryFriction
from ..scalars import Scalar

CUTS = 4  # of a step into equal parts, beside where the joint turns
SPANS = CUTS + 2
WIDTH = math.log(4)  # of a straight transition that loses as much as `tanh(rate)`
TINY = 1e-30
SHORTEST = 1e-9  # part of a step


class Stepping(NamedTuple):
    """How a sample interval is integrated.

    - `substeps` in it, each gone through `passes` times, the last with the dry friction
      that those before it found: one where there is none
    - `lightness` of every joint, its acceleration by a torque of its own [1/(kg m^2)]
    """

    substeps: Int[Array, ""]
    passes: Int[Array, ""]
    lightness: Float[Array, " joints"]


class Bristle(NamedTuple):
    """What bends as a joint turns: `width` [rad/s] of the change of sign, `presliding` s [rad], `damping` d [s]."""

    width: Scalar
    presliding: Scalar
    damping: Scalar

    def in_steps(self, step: Scalar) -> "Bristle":
        """The same with `step` [s] as the unit of time, and rates left in rad/s."""
        return Bristle(self.width, self.presliding / step, self.damping / step)

    def grip(self, rate: Scalar, bend: Scalar) -> Scalar:
        """`z + d z'`, of which friction is a multiple."""
        slipping = jnp.maximum(jnp.abs(rate), self.width)
        bends = self.presliding > 0
        speed = (rate - slipping * bend) / jnp.where(bends, self.presliding, 1.0)
        return bend + jnp.where(bends, self.damping * speed, 0.0)


class Law(NamedTuple):
    """Dry friction of a joint, `-T(v, z) (z + d z')` [N m]: its effects as one bristle z.

    The `bristle` is the mean of theirs, by size.
    """

    effects: tuple[AbstractDryFriction, ...]
    bristle: Bristle

    def resistance(self, rate: Scalar, bend: Scalar) -> Scalar:
        """T [N m]."""
        return sum((e.resistance(jnp.abs(rate), bend) for e in self.effects), jnp.zeros_like(rate))


def law(model: AssembledArm, joint: int) -> Law:
    """The dry friction of a joint."""
    own = tuple(e for e in joint_effects(model) if isinstance(e, AbstractDryFriction) and e.index == joint)
    zero = jnp.zeros(())
    sizes = [jnp.abs(e.resistance(zero, 1.0)) + TINY for e in own]
    whole = sum(sizes, zero + TINY)

    def mean(values: list[Scalar]) -> Scalar:
        return sum((size * value for size, value in zip(sizes, values, strict=True)), zero) / whole

    width = mean([e.transition_rate for e in own])
    presliding = mean([zero if e.presliding is None else e.presliding for e in own])
    damping = mean([zero if e.presliding is None else e.bristle_damping for e in own])
    return Law(own, Bristle(WIDTH * width + TINY, presliding, damping))


def span(
    rate: Scalar,
    bend: Scalar,
    push: Scalar,
    friction: Scalar,
    length: Scalar,
    bristle: Bristle,
) -> tuple[Scalar, Scalar]:
    """Rate and bristle after a span of `v' = push - friction (z + d z')`, `s z' = v - max(|v|, width) z`."""
    # (v - c)(s + l |v|) + f (s z + l v) = 0, f = (l + d) friction, c = v0 + l push + d friction z
    width, presliding, damping = bristle
    free = rate + length * push + damping * friction * bend
    force = (length + damping) * friction
    held = presliding + length * width
    turning = (free * held - force * presliding * bend) / (held + length * force)
    side = jnp.sign(turning)
    b = presliding - length * side * free + length * force
    c = presliding * (force * side * bend - side * free)
    slides = jnp.abs(turning) > width
    root = jnp.sqrt(jnp.where(slides, b * b - 4 * length * c, 1.0))
    ahead = b > 0
    quotient = jnp.where(ahead, -2 * c, root - b) / jnp.where(ahead, b + root, 2 * length)
    end = jnp.where(slides, side * quotient, turning)
    return end, (presliding * bend + length * end) / (presliding + length * jnp.maximum(jnp.abs(end), width))


def flow(
    rate: Scalar,
    bend: Scalar,
    push: Scalar,
    friction: Callable[[Scalar, Scalar], Scalar],
    bristle: Bristle,
) -> tuple[Scalar, Scalar]:
    """Rate and bristle after a unit of time of `v' = push - T (z + d z')`, `s z' = v - max(|v|, width) z`.

    `friction` T of rate and bristle is taken at the rate halfway through each span, as its slope
    at the beginning foretells it.
    """

    def onward(_, carry):
        v, z, left = carry
        length = jnp.minimum(left, 1 / CUTS)
        slope = push - friction(v, z) * bristle.grip(v, z)
        turns = slope * v < 0
        wait = jnp.where(turns, -v / jnp.where(turns, slope, 1.0), jnp.inf)
        length = jnp.where((jnp.abs(v) > bristle.width) & (wait < length), wait, length)
        length = jnp.maximum(length, SHORTEST)
        halfway = friction(v + length / 2 * slope, z)
        v, z = span(v, z, push, halfway, length, bristle)
        return v, z, jnp.maximum(left - length, 0.0)

    end, bend, _ = jax.lax.fori_loop(0, SPANS, onward, (rate, bend, jnp.ones_like(rate)))
    return end, bend


def dry_friction(
    model: AssembledArm,
    stepping: Stepping,
    starts: tuple,
    ends: tuple,
    bends: tuple,
    before: tuple,
    step: Scalar,
) -> tuple[tuple, tuple]:
    """Mean torque [N m] of the dry friction at every joint over a step, and how its bristles are bent then.

    `starts` and `ends`: rates about a step under the friction `before`, from which follows
    what all else would have done; `bends` of the bristles as it begins.
    """
    found, bent = [], []
    for joint, (start, end, bend, old) in enumerate(zip(starts, ends, bends, before, strict=True)):
        gain = step * stepping.lightness[joint]
        own = law(model, joint)
        free = end - gain * old

        def slowing(rate, bend, gain=gain, own=own):
            return gain * own.resistance(rate, bend)

        after, then = flow(start, bend, free - start, slowing, own.bristle.in_steps(step))
        found.append((after - free) / gain)
        bent.append(then)
    return tuple(found), tuple(bent)


def friction_at(model: AssembledArm, rates: tuple, bends: tuple) -> tuple:
    """Torque [N m] of the dry friction at every joint at an instant."""
    laws = [law(model, joint) for joint in range(len(rates))]
    return tuple(
        -own.resistance(v, z) * own.bristle.grip(v, z) for own, v, z in zip(laws, rates, bends, strict=True)
    )
