"""The arms that are compared, undamped and driven by torques."""

import jaxflex as jf


def two_links(payload: float) -> jf.Arm:
    """The two-link arm of Ahmad et al. (2008)."""
    return jf.ahmad_arm(payload, drive="torque", damping=0.0)


def one_link(payload: float, hub_inertia: float = 0.02, modes: int = 2) -> jf.Arm:
    """One link of the same arm on a hub."""
    link = jf.Link(length=0.5, mass_per_length=0.2, flexural_rigidity=1.0, modes=modes)
    return jf.Arm((link,), (jf.Joint(hub_inertia=hub_inertia),), jf.Payload(payload))
