"""An independent model of the two-link arm: cubic beam elements on two axes, no JAX, no mode shapes.

Each link is inextensible, so its points move along with its root and its deflection is
all that is left: link 1 turns about the base; the root of link 2 follows the tip of
link 1 and its heading differs by the angle of the second joint.
"""

import numpy as np
import scipy.linalg


def beam(length: float, rho: float, rigidity: float, count: int):
    """Mass and stiffness of `count` Hermite elements; displacement and slope of every node."""
    h = length / count
    stiff = rigidity / h**3 * np.array(
        [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
         [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]
    )  # fmt: skip
    mass = rho * h / 420 * np.array(
        [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
         [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]
    )  # fmt: skip
    m, k = np.zeros((2 * count + 2,) * 2), np.zeros((2 * count + 2,) * 2)
    for e in range(count):
        at = slice(2 * e, 2 * e + 4)
        m[at, at] += mass
        k[at, at] += stiff
    return m, k


def arm_frequencies(
    payload: float, bend: float, count: int, locked: bool,
    length=0.5, rho=0.2, rigidity=1.0, hub_inertia=0.02, centre=1.0,
) -> np.ndarray:  # fmt: skip
    """Natural frequencies [Hz] of Ahmad's arm, the second joint at `bend` [rad].

    Unknowns: slope of the root of link 1, displacement and slope of its other nodes, and the
    same of link 2, whose root moves across link 2 by `cos(bend)` times the tip of link 1; along
    link 2, by `sin(bend)` times it, goes the whole of link 2 with its payload.
    """
    m, k = beam(length, rho, rigidity, count)
    n = 2 * count + 2
    tip, slope = n - 2, n - 1  # of a link
    # columns of the unknowns: link 1 without its pinned root, link 2 without the displacement of its root
    first = np.zeros((n, 2 * n - 2))
    first[1:, : n - 1] = np.eye(n - 1)
    second = np.zeros((n, 2 * n - 2))
    second[0, tip - 1] = np.cos(bend)
    second[1:, n - 1 :] = np.eye(n - 1)
    mass = first.T @ m @ first + second.T @ m @ second
    stiff = first.T @ k @ first + second.T @ k @ second

    def add(row, value):
        nonlocal mass
        mass = mass + value * np.outer(row, row)

    add(first[1], hub_inertia)
    add(second[1], hub_inertia)
    add(first[tip], centre)
    add(second[tip], payload)
    add(np.sin(bend) * first[tip], rho * length + payload)
    if locked:
        # both hubs turn with what they sit on: no slope at the root, and one slope at the second joint
        keep = np.delete(np.eye(2 * n - 2), [0, n - 1], axis=1)
        keep[n - 1, slope - 2] = 1.0
        mass, stiff = keep.T @ mass @ keep, keep.T @ stiff @ keep
    squares = scipy.linalg.eigh(stiff, mass, eigvals_only=True)
    return np.sqrt(np.maximum(squares, 0.0)) / (2 * np.pi)
