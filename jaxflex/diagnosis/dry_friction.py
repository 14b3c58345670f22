"""Dry friction over a step of the integration.

It is too stiff for explicit steps, and jumps where implicit ones want a slope. But over a
step all other forces are as good as constant, and what is left are two unknowns, the rate
and the bristle. Backward Euler in these is a quadratic equation, stable at any step and for
any bristle, down to none (Moreau's time stepping); the step is cut where the joint turns.
The mean of the friction on the way acts in the step as a constant torque.
"""

import math
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


class Law(NamedTuple):
    """Dry friction of a joint, `-(resistance + asymmetry z) z` [N m].

    `width` [rad/s] of the change of its sign, and the `presliding` [rad] of the bristle z.
    """

    resistance: Scalar
    asymmetry: Scalar
    width: Scalar
    presliding: Scalar


def law(model: AssembledArm, joint: int, speed: Scalar) -> Law:
    """The dry friction of a joint [N m] around a `speed`: all effects there as one bristle.

    Width and presliding are the means of theirs, by size.
    """
    own = [e for e in joint_effects(model) if isinstance(e, AbstractDryFriction) and e.index == joint]
    zero = jnp.zeros_like(speed)
    ahead, back = (sum((e.resistance(speed, s) for e in own), zero) for s in (1.0, -1.0))
    sizes = [jnp.abs(e.resistance(zero, 1.0)) + TINY for e in own]
    whole = sum(sizes, zero + TINY)
    width = sum((s * e.transition_rate for s, e in zip(sizes, own, strict=True)), zero) / whole
    bends = [zero if e.presliding is None else e.presliding for e in own]
    presliding = sum((s * b for s, b in zip(sizes, bends, strict=True)), zero) / whole
    return Law((ahead + back) / 2, (ahead - back) / 2, WIDTH * width + TINY, presliding)


def span(
    rate: Scalar,
    bend: Scalar,
    push: Scalar,
    friction: Scalar,
    length: Scalar,
    width: Scalar,
    presliding: Scalar,
) -> tuple[Scalar, Scalar]:
    """Rate and bristle after a span of `v' = push - friction z`, `s z' = v - max(|v|, width) z`."""
    # (v - c)(s + l |v|) + f (s z + l v) = 0, c = v0 + l push, f = l friction
    free, force = rate + length * push, length * friction
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
    rate: Scalar, bend: Scalar, push: Scalar, friction: Scalar, width: Scalar, presliding: Scalar
) -> tuple[Scalar, Scalar]:
    """Rate and bristle after a unit of time of `v' = push - friction z`, `s z' = v - max(|v|, width) z`."""

    def onward(_, carry):
        v, z, left = carry
        length = jnp.minimum(left, 1 / CUTS)
        slope = push - friction * z
        turns = slope * v < 0
        wait = jnp.where(turns, -v / jnp.where(turns, slope, 1.0), jnp.inf)
        length = jnp.where((jnp.abs(v) > width) & (wait < length), wait, length)
        length = jnp.maximum(length, SHORTEST)
        v, z = span(v, z, push, friction, length, width, presliding)
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
        own = law(model, joint, (jnp.abs(start) + jnp.abs(end)) / 2)
        free = end - gain * old
        size = own.resistance + own.asymmetry * bend
        after, then = flow(start, bend, free - start, gain * size, own.width, own.presliding / step)
        found.append((after - free) / gain)
        bent.append(then)
    return tuple(found), tuple(bent)


def friction_at(model: AssembledArm, rates: tuple, bends: tuple) -> tuple:
    """Torque [N m] of the dry friction at every joint at an instant."""
    laws = [law(model, joint, jnp.abs(rate)) for joint, rate in enumerate(rates)]
    return tuple(-(own.resistance + own.asymmetry * z) * z for own, z in zip(laws, bends, strict=True))
