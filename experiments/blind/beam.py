"""A flexible link by Hermitian beam finite elements, reduced to its lowest clamped modes."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

ELEMENTS = 10


@dataclass(frozen=True)
class Beam:
    """A uniform cantilever with a rigid body at its tip, in modes of unit modal mass.

    Seen from axes that turn with its root, the deflection is `w = sum_k phi_k(x) q_k`.

    - `frequency` [rad/s] of the clamped modes
    - `inertia` [kg m^2] of the undeflected link and tip body about the root;
      `first_moment` [kg m], `mass` [kg] of both
    - `coupling` `int rho x phi_k dx` [kg^0.5 m] with the turning of the root;
      `weight` `int rho phi_k dx` [kg^0.5] with its sideways motion, tip body included
    - `tip` `phi_k(l)`, `tip_slope` `phi_k'(l)`, `root_curvature` `phi_k''(0)`
    - `foreshortening`: matrix `int P phi_j' phi_k' dx`, P the axial force at 1 rad/s
    """

    frequency: np.ndarray
    inertia: float
    first_moment: float
    mass: float
    coupling: np.ndarray
    weight: np.ndarray
    tip: np.ndarray
    tip_slope: np.ndarray
    root_curvature: np.ndarray
    foreshortening: np.ndarray


def clamped_beam(
    length, mass_per_length, rigidity, tip_mass, tip_inertia, modes, carried=0.0, root_compliance=0.0
):
    """The `modes` lowest modes of a link of `length` [m], [kg/m], [N m^2] with a body at its tip.

    Where it has to carry more than that body, `carried` [kg] beyond its tip, the shapes are those
    that suit the load: modes with all of the mass, and the bending under a moment at the tip. With
    a `root_compliance` [rad/(N m)] the root may turn under the hub's axis, on a spring.
    """
    h = length / ELEMENTS
    size = 2 * (ELEMENTS + 1)
    mass, stiff, tension = np.zeros((size, size)), np.zeros((size, size)), np.zeros((size, size))
    inertia_element = (
        mass_per_length * h / 420
        * np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
                    [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]])
    )  # fmt: skip
    bending_element = (
        rigidity / h**3
        * np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
                    [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]])
    )  # fmt: skip
    points, weights = np.polynomial.legendre.leggauss(4)
    s = (points + 1) / 2
    slopes = np.stack(
        [(6 * s * s - 6 * s) / h, 1 - 4 * s + 3 * s * s, (6 * s - 6 * s * s) / h, 3 * s * s - 2 * s]
    )
    for e in range(ELEMENTS):
        part = slice(2 * e, 2 * e + 4)
        mass[part, part] += inertia_element
        stiff[part, part] += bending_element
        x = (e + s) * h
        axial = mass_per_length * (length**2 - x**2) / 2 + (tip_mass + carried) * length
        tension[part, part] += (slopes * (axial * weights * h / 2)) @ slopes.T
    mass[-2, -2] += tip_mass
    mass[-1, -1] += tip_inertia
    if root_compliance > 0:
        stiff[1, 1] += 1 / root_compliance
    free = slice(1 if root_compliance > 0 else 2, size)
    stiff_free, mass_free = stiff[free, free], mass[free, free]
    shapes = np.eye(len(stiff_free))
    if carried > 0:
        loaded = mass_free.copy()
        loaded[-2, -2] += carried
        _, suited = scipy.linalg.eigh(stiff_free, loaded, subset_by_index=[0, modes - 2])
        bent = np.linalg.solve(stiff_free, np.eye(len(stiff_free))[:, -1:])
        shapes = np.concatenate([suited, bent / np.abs(bent).max()], axis=1)
    squares, mixing = scipy.linalg.eigh(
        shapes.T @ stiff_free @ shapes, shapes.T @ mass_free @ shapes, subset_by_index=[0, max(modes, 1) - 1]
    )
    squares, shapes = squares[:modes], (shapes @ mixing)[:, :modes]
    shapes = shapes * np.sign(shapes[-2])
    full = np.vstack([np.zeros((size - len(shapes), modes)), shapes])
    turning = np.zeros(size)
    turning[0::2], turning[1::2] = np.arange(ELEMENTS + 1) * h, 1.0
    sideways = np.zeros(size)
    sideways[0::2] = 1.0
    curvature_at_root = np.array([-6, -4 * h, 6, -2 * h]) / h**2
    return Beam(
        frequency=np.sqrt(squares),
        inertia=float(turning @ mass @ turning),
        first_moment=float(turning @ mass @ sideways),
        mass=float(sideways @ mass @ sideways),
        coupling=turning @ mass @ full,
        weight=sideways @ mass @ full,
        tip=full[-2],
        tip_slope=full[-1],
        root_curvature=curvature_at_root @ full[:4],
        foreshortening=full.T @ tension @ full,
    )
