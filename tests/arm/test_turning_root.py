"""A link that turns at its root keeps its length: independent formulations agree to second order in the turn."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from jaxflex.dynamics.lagrange import accelerations

HUB, STIFFNESS = 2e-3, 3.0
HUB_RATE = 7.0  # rad/s
FORCE = 0.02  # N m at the hub, as a share of the size of all that is small


def link(**options):
    return jf.Link(0.4, 0.3, 0.7, modes=2, damping_ratio=0.0, **options)


def accelerated(arm, q, qd, torque):
    model = arm.assemble()
    found = accelerations(model, *(tuple(jnp.asarray(x) for x in part) for part in (q, qd, torque)))
    return np.array([float(a) for a in found])


def loose_and_jointed(link_options, size):
    """Accelerations of hub, shapes and turn: by a loose joint, and by two joints with a torque between them.

    The hub turns fast; turn, deflections and their rates are small of the same order.
    """
    turn, first, second = size, 0.02 * size, -1e-4 * size
    turning, first_rate, second_rate = 3.0 * size, -0.4 * size, 0.3 * size
    payload = jf.Payload(0.05, 1e-4)
    spring = jf.Joint(HUB, play=0.0, contact_stiffness=STIFFNESS)
    loose = jf.Arm((link(**link_options),), (spring,), payload)
    massless = jf.Link(1e-9, 1e-12, 1.0, modes=0)
    jointed = jf.Arm((massless, link(**link_options)), (jf.Joint(HUB), jf.Joint()), payload)
    rates = (HUB_RATE, first_rate, second_rate, turning)
    one = accelerated(loose, (0.3, first, second, turn), rates, (FORCE * size, 0.0, 0.0, 0.0))
    rates = (HUB_RATE, turning, first_rate, second_rate)
    torque = (FORCE * size, -STIFFNESS * turn, 0.0, 0.0)
    two = accelerated(jointed, (0.3, turn, first, second), rates, torque)
    return one, two[[0, 2, 3, 1]]


@pytest.mark.parametrize("options", [{}, {"shortening": 1.0}])
def test_a_loose_root_is_a_joint_with_a_spring(options):
    """All that is of first order agrees (without the shortening by the turn 2 % of it do not)."""
    for size in (1e-2, 1e-4):
        one, two = loose_and_jointed(options, size)
        np.testing.assert_allclose(one, two, atol=1e-5 * np.abs(two).max())


def test_turning_the_hub_does_not_soften_its_spring():
    """`eta'' = -k (1/J_h + 1/J) eta` of a rigid link at any rate of the hub, and not `-(k - J Omega^2)`."""
    bar = jf.Link(0.4, 0.3, 1.0, modes=0)
    arm = jf.Arm((bar,), (jf.Joint(HUB, play=0.0, contact_stiffness=STIFFNESS),))
    inertia = 0.3 * 0.4**3 / 3
    for rate in (0.0, 20.0):
        found = accelerated(arm, (0.0, 1e-4), (rate, 0.0), (0.0, 0.0))
        np.testing.assert_allclose(found[-1], -STIFFNESS * (1 / HUB + 1 / inertia) * 1e-4, rtol=1e-6)


@pytest.mark.parametrize("soft", ["clamp", "joint"])
def test_a_root_that_gives_way_is_not_softened_by_turning(soft):
    """A stiff link on a spring, its turn following the moment: the hub's rate adds nothing to its acceleration."""
    bar, joint = jf.Link(0.4, 0.3, 1e7, modes=1, damping_ratio=0.0), jf.Joint(HUB)
    if soft == "clamp":
        bar = dataclasses.replace(bar, root_compliance=1 / STIFFNESS)
    else:
        joint = dataclasses.replace(joint, compliance=1 / STIFFNESS)
    arm = jf.Arm((bar,), (joint,))
    still, turning = (accelerated(arm, (0.0, 1e-5), (rate, 0.0), (0.0, 0.0)) for rate in (0.0, 20.0))
    np.testing.assert_allclose(turning, still, rtol=1e-5)


def test_a_linear_link_stays_linear():
    """`motion = "small"` leaves every term of second order out."""
    arm = jf.Arm((link(motion="small", root_compliance=0.1),), (jf.Joint(HUB),))
    assert arm.assemble().links[0].shortening is None
