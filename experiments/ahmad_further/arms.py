"""The arms that are carried further than the paper, a motor at every joint."""

import dataclasses

import jax.numpy as jnp
import numpy as np

import jaxflex as jf

STANDARD_GRAVITY = 9.80665  # m/s^2
TILT = 1.0  # deg of the base, that the arm can bear


def tilted(arm: jf.Arm, degrees: float) -> jf.Arm:
    """`arm` on a base tilted so that a part of gravity pulls along -y; 90 deg is a wall mount."""
    return dataclasses.replace(arm, gravity=STANDARD_GRAVITY * np.sin(np.deg2rad(degrees)))


def three_links(payload: float, modes: int = 1) -> jf.Arm:
    """A third link of the same make, with its motor, beyond the second."""
    two = jf.ahmad_arm(payload, modes=modes)
    return dataclasses.replace(
        two,
        links=(*two.links, two.links[-1]),
        joints=(*two.joints, two.joints[-1]),
        name="three links after Ahmad et al. (2008)",
    )


def sag(arm: jf.Arm) -> list[float]:
    """Static tip deflection of every link as a share of its length, stretched along x, joints held.

    Linear in gravity, so that a large share says only that the arm cannot bear it.
    """
    model = arm.assemble()
    rest = jnp.zeros(model.size)
    pull = jf.gravity_vector(model, rest)
    _, etas = model.split(
        tuple(-p / jnp.where(k > 0, k, jnp.inf) for p, k in zip(pull, model.stiffness(), strict=True))
    )
    return [
        float(sum(t * e for t, e in zip(link.tip_deflection, eta, strict=True)) / link.length)
        for link, eta in zip(model.links, etas, strict=True)
    ]
