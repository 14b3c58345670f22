"""Dry friction over a step of the integration.

It is too stiff for explicit steps, and jumps where implicit ones want a slope. But over a
step all other forces are as good as constant, and then the rate under a friction that goes
straight from one side to the other has a closed form: sliding on, coming to rest, sticking,
breaking loose. The mean of the friction on the way acts in the step as a constant torque.
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

PHASES = 3  # of a step: slide to rest, turn, slide the other way
WIDTH = math.log(4)  # of a straight transition that loses as much as `tanh(rate)`
TINY = 1e-30


class Stepping(NamedTuple):
    """How a sample interval is integrated.

    - `substeps` in it, each gone through `passes` times, the last with the dry friction
      that those before it found: one where there is none
    - `lightness` of every joint, its acceleration by a torque of its own [1/(kg m^2)]
    """

    substeps: Int[Array, ""]
    passes: Int[Array, ""]
    lightness: Float[Array, " joints"]


def flow(rate: Scalar, push: Scalar, friction: Scalar, width: Scalar) -> Scalar:
    """`v(1)` of `v' = push - friction clip(v / width, -1, 1)` from `v(0) = rate`, in closed form."""
    there = friction > TINY
    friction = jnp.where(there, friction, 1.0)
    balance = push * width / friction

    def phase(_, carry):
        v, side, left = carry
        # inside the transition: towards the balance, out where that lies outside
        exits = jnp.sign(balance) * (jnp.abs(balance) > width)
        ratio = (v - balance) / jnp.where(exits == 0, 1.0, exits * width - balance)
        turn = width / friction
        needs = jnp.where(exits == 0, jnp.inf, turn * jnp.log(jnp.where(exits == 0, 1.0, ratio)))
        inside = jnp.minimum(needs, left)
        turned = balance + (v - balance) * jnp.exp(-inside / turn)
        # outside: straight, until the transition begins
        slope = push - side * friction
        returns = (side * slope < 0) & (side != 0)
        wait = jnp.where(returns, (side * width - v) / jnp.where(returns, slope, 1.0), jnp.inf)
        outside = jnp.minimum(wait, left)
        out = side != 0
        after = jnp.where(out, v + slope * outside, turned)
        taken = jnp.where(out, outside, inside)
        over = jnp.where(out, wait <= left, needs <= left)
        return after, jnp.where(over, jnp.where(out, 0.0, exits), side), left - taken

    side = jnp.sign(rate) * (jnp.abs(rate) > width)
    end, _, _ = jax.lax.fori_loop(0, PHASES, phase, (rate, side, jnp.ones_like(rate)))
    return jnp.where(there, end, rate + push)


def dry_friction(
    model: AssembledArm, stepping: Stepping, starts: tuple, ends: tuple, before: tuple, step: Scalar
) -> tuple:
    """Mean torque [N m] of the dry friction at every joint over a step.

    `starts` and `ends`: rates about a step under the friction `before`, from which follows
    what all else would have done.
    """
    laws = [e for e in joint_effects(model) if isinstance(e, AbstractDryFriction)]
    found = []
    for joint, (start, end, old) in enumerate(zip(starts, ends, before, strict=True)):
        gain = step * stepping.lightness[joint]
        own = [e for e in laws if e.index == joint]
        speed = (jnp.abs(start) + jnp.abs(end)) / 2
        ahead, back = (sum((e.resistance(speed, s) for e in own), jnp.zeros_like(end)) for s in (1.0, -1.0))
        sizes = [jnp.abs(e.resistance(jnp.zeros_like(end), 1.0)) + TINY for e in own]
        width = sum((s * e.transition_rate for s, e in zip(sizes, own, strict=True)), jnp.zeros_like(end))
        width = WIDTH * width / sum(sizes, jnp.full_like(end, TINY)) + TINY
        free = end - gain * old
        push = free - start - gain * (ahead - back) / 2
        after = flow(start, push, gain * (ahead + back) / 2, width)
        found.append((after - free) / gain)
    return tuple(found)
