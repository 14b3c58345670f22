"""Elastic frequencies of lumped chains on a hinge, for a number of masses."""

import numpy as np
import scipy.linalg

import jaxflex as jf


def middle_chain(arm: jf.Arm) -> np.ndarray:
    """Frequencies [Hz] of an arm with a lumped link of the library: every mass in the middle of its part."""
    return np.asarray(jf.driven_frequencies(arm))[1:]


def far_end_chain(link: jf.Link, masses: int, hub_inertia: float = 0.0) -> np.ndarray:
    """Frequencies [Hz] of a chain on a free hinge, every mass at the far end of its part.

    A part of length h = l/n has a torsion spring EI/h at its near end and its mass at its
    far end, so that the last mass sits on the tip. `hub_inertia` [kg m^2].
    """
    length, h = float(link.length), float(link.length) / masses
    far, near = h * np.arange(1, masses + 1), h * np.arange(masses)
    # coordinates: the angle of the hub, then those of the springs
    lift = np.column_stack([far, np.maximum(far[:, None] - near, 0.0)])
    inertia = float(link.mass) / masses * lift.T @ lift
    inertia[0, 0] += max(hub_inertia, 1e-9 * float(link.mass) * length**2)  # none at all is singular
    stiffness = np.diag([0.0] + [float(link.flexural_rigidity) / h] * masses)
    squares = scipy.linalg.eigh(stiffness, inertia, eigvals_only=True)
    return np.sqrt(np.maximum(squares[1:], 0.0)) / (2 * np.pi)
