"""Kinetic and potential energy: the two functions from which all dynamics follow."""

import jax.numpy as jnp

from ..beam.link_model import half_form, symmetric_form
from ..scalars import Scalar, dot
from ..trigonometry import sin_cos
from .arm import AssembledArm
from .bodies import bodies, payload_moves
from .kinematics import poses, velocities


def kinetic_energy(model: AssembledArm, q: tuple, qd: tuple) -> Scalar:
    """`T = T_R + T_L + T_PL` [J] (Ahmad et al. (6)-(8), (12), (13)).

    A point of link i moves with `(u - omega w, v + omega x + w')` along the link's axes,
    `(u, v)` and `omega` the velocity and rate of its frame; squared and integrated over
    the link this leaves the constants of its `Body`, in which hub and payload are counted.
    Added are the rotors at their relative rate.

    `q`, `qd`: tuples of `model.size` scalars.
    """
    frames, tips = velocities(model, q, qd)
    rates, _ = model.split(qd)
    _, etas = model.split(q)
    _, eta_rates = model.split(qd)
    twice = jnp.zeros_like(rates[0])
    for i, body in enumerate(bodies(model)):
        u, v, omega = frames[i]
        eta, eta_rate = etas[i], eta_rates[i]
        bent = dot(body.deflection, eta)
        spread = 0.0 if body.spread is None else symmetric_form(body.spread, eta)
        bending = dot(body.deflection, eta_rate)
        spin = dot(body.rotation, eta_rate)
        twice = (
            twice
            + body.mass * (u * u + v * v)
            + omega * omega * (body.second_moment + spread)
            + symmetric_form(body.modal_inertia, eta_rate)
            + 2 * (omega * (v * body.first_moment - u * bent + spin) + v * bending)
        )
        if body.drawn is not None and body.spun is not None:
            # a point that bending draws in by s(x) moves with (u - s', v + omega (x - s)): to the
            # second order in the deflection, that is what the cross terms with s take away
            drawn, spun = half_form(body.drawn, eta, eta), half_form(body.spun, eta, eta)
            drawing = 2 * half_form(body.drawn, eta, eta_rate)
            twice = twice - 2 * (u * drawing + omega * (v * drawn + omega * spun))
        if i > 0:
            twice = twice + model.joints[i].reflected_inertia * rates[i] * rates[i]
    if payload_moves(model):
        payload, tip = model.arm.payload, tips[-1]
        twice = twice + payload.mass * (tip.x * tip.x + tip.y * tip.y)
        twice = twice + payload.inertia * tip.rate * tip.rate
    return 0.5 * twice


def potential_energy(model: AssembledArm, q: tuple) -> Scalar:
    """`U` [J]: bending of the links (Ahmad et al. (14)), and gravity where there is any."""
    _, etas = model.split(q)
    energy = jnp.zeros_like(model.arm.payload.mass)
    for link, joint, eta in zip(model.links, model.joints, etas, strict=True):
        energy = energy + 0.5 * dot(link.stiffness, tuple(e * e for e in eta))
        if link.loose and joint.contact_stiffness is not None:
            pressed = joint.pressed(eta[-1])
            energy = energy + 0.5 * joint.contact_stiffness * pressed * pressed
    if model.arm.gravity is None and model.arm.side_gravity is None:
        return energy
    moment_x, moment_y = mass_moments(model, q)
    if model.arm.gravity is not None:
        energy = energy + model.arm.gravity * moment_y
    if model.arm.side_gravity is not None:
        energy = energy + model.arm.side_gravity * moment_x
    return energy


def mass_moments(model: AssembledArm, q: tuple) -> tuple[Scalar, Scalar]:
    """`(int x dm, int y dm)` [kg m] of the whole arm in the base frame."""
    _, etas = model.split(q)
    frames, tips = poses(model, q)
    payload = model.arm.payload.mass
    along, across = payload * tips[-1].x, payload * tips[-1].y
    for i, (link, joint) in enumerate(zip(model.links, model.joints, strict=True)):
        frame = frames[i]
        s, c = sin_cos(frame.heading)
        bent = dot(link.deflection_integral, etas[i])
        reach = link.first_moment
        if link.shortening is not None:
            reach = reach - half_form(link.shortening.mean, etas[i], etas[i])
        mass = link.mass + joint.hub_mass
        along = along + mass * frame.x + c * reach - s * bent
        across = across + mass * frame.y + s * reach + c * bent
    return along, across
