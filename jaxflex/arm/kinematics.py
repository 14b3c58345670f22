"""Where the links are and how fast: frames chained from base to tip (Ahmad et al. (1)-(5), (9)-(11)).

Frame i sits at the root of link i, its x axis along the undeflected link. The next
frame is turned by the slope at the tip and by the joint, `A(theta) E(w')`. The paper
writes E to first order, `[[1, -w'], [w', 1]]`; here it is the rotation by w' itself,
which agrees to first order and keeps lengths, so that one sine and cosine of
`theta_{i+1} + w_i'(l_i)` serve a joint and energy does not depend on the heading.

Velocities are carried in the links' own frames: nothing then depends on where the base
points, and the energies need no absolute angle unless there is gravity.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..beam.link_model import LinkModel, half_form
from ..scalars import Scalar, dot
from ..trigonometry import sin_cos
from .arm import Arm, AssembledArm


class FrameVelocity(NamedTuple):
    """Velocity [m/s] of a frame's origin along its own axes, and its rate [rad/s]."""

    x: Scalar | float
    y: Scalar | float
    rate: Scalar


class TipVelocity(NamedTuple):
    """Velocity [m/s] of a link's tip along the link's axes, and the rate [rad/s] of its tangent."""

    x: Scalar
    y: Scalar
    rate: Scalar


class Pose(NamedTuple):
    """Position [m] in the base frame and heading [rad]."""

    x: Scalar | float
    y: Scalar | float
    heading: Scalar


def velocities(model: AssembledArm, q: tuple, qd: tuple) -> tuple[list[FrameVelocity], list[TipVelocity]]:
    """Velocities of every link's frame and tip, each along the axes of that link."""
    angles, etas = model.split(q)
    rates, eta_rates = model.split(qd)
    frames, tips = [], []
    frame = FrameVelocity(0.0, 0.0, rates[0])
    for i, link in enumerate(model.links):
        deflection = dot(link.tip_deflection, etas[i])
        length, shrinking = reach(link, etas[i]), 0.0
        if link.shortening is not None:
            shrinking = 2 * half_form(link.shortening.tip, etas[i], eta_rates[i])
        tip = TipVelocity(
            frame.x - frame.rate * deflection - shrinking,
            frame.y + frame.rate * length + dot(link.tip_deflection, eta_rates[i]),
            frame.rate + dot(link.tip_slope, eta_rates[i]),
        )
        frames.append(frame)
        tips.append(tip)
        if i + 1 < len(model.links):
            turn = angles[i + 1] + dot(link.tip_slope, etas[i])
            s, c = sin_cos(turn)
            frame = FrameVelocity(c * tip.x + s * tip.y, c * tip.y - s * tip.x, tip.rate + rates[i + 1])
    return frames, tips


def poses(model: AssembledArm, q: tuple) -> tuple[list[Pose], list[Pose]]:
    """Pose of every link's frame and of every link's tip in the base frame (Ahmad et al. (5))."""
    angles, etas = model.split(q)
    frames, tips = [], []
    frame = Pose(0.0, 0.0, angles[0])
    for i, link in enumerate(model.links):
        deflection = dot(link.tip_deflection, etas[i])
        length = reach(link, etas[i])
        s, c = sin_cos(frame.heading)
        tip = Pose(
            frame.x + c * length - s * deflection,
            frame.y + s * length + c * deflection,
            frame.heading + dot(link.tip_slope, etas[i]),
        )
        frames.append(frame)
        tips.append(tip)
        if i + 1 < len(model.links):
            frame = Pose(tip.x, tip.y, tip.heading + angles[i + 1])
    return frames, tips


def reach(link: LinkModel, eta: tuple) -> Scalar:
    """Length [m] of a link along its own axis: `l - s(l)` where bending shortens it."""
    if link.shortening is None:
        return link.length
    return link.length - half_form(link.shortening.tip, eta, eta)


def tip_position(arm: Arm, angles: Float[Array, " joints"]) -> Float[Array, "2"]:
    """Where the tip [m] is in the base frame with the joints at `angles` [rad] and the links straight."""
    headings = jnp.cumsum(angles)[: len(arm.links)]
    lengths = jnp.array([link.length for link in arm.links]).reshape(-1)
    return jnp.stack([jnp.sum(lengths * jnp.cos(headings)), jnp.sum(lengths * jnp.sin(headings))])
