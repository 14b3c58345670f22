"""The arms that are compared, undamped and driven by torques."""

import dataclasses

import jaxflex as jf

LENGTH = 0.5  # m, of every link
LINK_INERTIA = 0.2 * LENGTH**3 / 3  # kg m^2, of a straight link about its root


def two_links(payload: float) -> jf.Arm:
    """The two-link arm of Ahmad et al. (2008)."""
    return jf.ahmad_arm(payload, drive="torque", damping=0.0)


def one_link(payload: float, hub_inertia: float = 0.02, modes: int = 3) -> jf.Arm:
    """One link of the same arm on a hub."""
    link = jf.Link(length=LENGTH, mass_per_length=0.2, flexural_rigidity=1.0, modes=modes)
    return jf.Arm((link,), (jf.Joint(hub_inertia=hub_inertia),), jf.Payload(payload))


def stiffened(arm: jf.Arm) -> jf.Arm:
    """`arm` with links that shorten as they bend."""
    links = tuple(dataclasses.replace(link, shortening=1.0) for link in arm.links)
    return dataclasses.replace(arm, links=links)
