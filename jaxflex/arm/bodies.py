"""What moves as one: a link with the hub at its root, and the payload at the tip of the last.

A mass at the tip has the integrals of a link whose mass sits at `x = l`, a hub those of one
at `x = 0`. Counted into the constants of the link they cost the equations of motion nothing.
"""

from typing import NamedTuple

from ..beam.link_model import LinkModel
from ..scalars import Scalar
from .arm import AssembledArm
from .parts import Payload

Rows = tuple[tuple[Scalar, ...], ...]


class Body(NamedTuple):
    """A link and what it carries, as constants of the kinetic energy.

    Those of `LinkModel` under shorter names; `spread` is the part of `modal_inertia` that
    comes of masses, without the payload's own inertia, and is what deflections add to the
    inertia about the root (None in small motion); `drawn`, `spun` are mean and moment of the shortening, or None.
    """

    mass: Scalar
    first_moment: Scalar
    second_moment: Scalar
    deflection: tuple[Scalar, ...]
    rotation: tuple[Scalar, ...]
    spread: Rows | None
    modal_inertia: Rows
    drawn: Rows | None
    spun: Rows | None


def bodies(model: AssembledArm) -> list[Body]:
    """The bodies of an arm from base to tip."""
    found = []
    for i, (link, joint) in enumerate(zip(model.links, model.joints, strict=True)):
        short = link.shortening
        found.append(
            Body(
                link.mass + (joint.hub_mass if i > 0 else 0.0),
                link.first_moment,
                # the first joint's rate is absolute, so its rotor turns with the link
                link.second_moment + joint.hub_inertia + (joint.reflected_inertia if i == 0 else 0.0),
                link.deflection_integral,
                link.rotation_integral,
                link.modal_inertia,
                link.modal_inertia,
                None if short is None else short.mean,
                None if short is None else short.moment,
            )
        )
        if link.loose:
            found[-1] = _beyond_play(found[-1], (1 - joint.motor_share) * joint.hub_inertia)
    if not payload_moves(model):
        found[-1] = _with_payload(found[-1], model.links[-1], model.arm.payload)
    for i, link in enumerate(model.arm.links):
        if link.moves_little:
            found[i] = found[i]._replace(spread=None)
    return found


def payload_moves(model: AssembledArm) -> bool:
    """True if bending draws the payload in, so that it is no constant of the last body."""
    return model.links[-1].shortening is not None


def _beyond_play(body: Body, inertia: Scalar) -> Body:
    """With the part of the hub's inertia that turns with the link where the last shape is the play."""
    *rows, last = body.modal_inertia
    return body._replace(
        rotation=(*body.rotation[:-1], body.rotation[-1] + inertia),
        modal_inertia=(*rows, (*last[:-1], last[-1] + inertia)),
    )


def _with_payload(body: Body, link: LinkModel, payload: Payload) -> Body:
    m, inertia, x = payload.mass, payload.inertia, link.length
    lift, slope = link.tip_deflection, link.tip_slope
    assert body.spread is not None
    spread = _plus(body.spread, m, _outer(lift))
    return Body(
        body.mass + m,
        body.first_moment + m * x,
        body.second_moment + m * x * x + inertia,
        tuple(a + m * w for a, w in zip(body.deflection, lift, strict=True)),
        tuple(a + m * x * w + inertia * s for a, w, s in zip(body.rotation, lift, slope, strict=True)),
        spread,
        _plus(_plus(body.modal_inertia, m, _outer(lift)), inertia, _outer(slope)),
        None,
        None,
    )


def _outer(a: tuple) -> Rows:
    return tuple(tuple(x * y for y in a) for x in a)


def _plus(rows: Rows, factor: Scalar, more: Rows) -> Rows:
    return tuple(
        tuple(a + factor * b for a, b in zip(row, extra, strict=True))
        for row, extra in zip(rows, more, strict=True)
    )
