"""An independent finite-element model of a planar arm: frame elements, a few lines, no JAX."""

import numpy as np
import scipy.linalg


def frame_frequencies(
    lengths, rho, rigidity, angles, hub_inertia, hub_mass, payload, locked, elements=24, axial=1e7
):
    """Natural frequencies [Hz] of an arm of equal section, ascending.

    Every element is a cubic beam with a nearly rigid axial spring. The base is pinned,
    or clamped if `locked`; a joint gives the next link a rotation of its own, or shares
    it if `locked`. `payload` = (mass, inertia).
    """
    count, elements_of = 0, []

    def new():
        nonlocal count
        count += 1
        return count - 1

    x, y, turn, heading = new(), new(), new(), 0.0
    fixed, inertias, masses = [x, y] + ([turn] if locked else []), [], []
    for i, length in enumerate(lengths):
        heading += angles[i]
        if i > 0 and not locked:
            turn = new()
        inertias.append((turn, hub_inertia[i]))
        if i > 0:
            masses.append((x, y, hub_mass[i]))
        for _ in range(elements):
            there = (new(), new(), new())
            elements_of.append(((x, y, turn, *there), heading, length / elements))
            x, y, turn = there
    masses.append((x, y, payload[0]))
    inertias.append((turn, payload[1]))
    mass, stiff = np.zeros((count, count)), np.zeros((count, count))
    for dofs, angle, h in elements_of:
        c, s = np.cos(angle), np.sin(angle)
        block = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        turned = scipy.linalg.block_diag(block, block)
        k, m = np.zeros((6, 6)), np.zeros((6, 6))
        bend = np.ix_([1, 2, 4, 5], [1, 2, 4, 5])
        along = np.ix_([0, 3], [0, 3])
        k[bend] = rigidity / h**3 * np.array(
            [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
             [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]
        )  # fmt: skip
        m[bend] = rho * h / 420 * np.array(
            [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
             [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]
        )  # fmt: skip
        k[along] = axial / h * np.array([[1, -1], [-1, 1]])
        m[along] = rho * h / 6 * np.array([[2, 1], [1, 2]])
        where = np.ix_(dofs, dofs)
        stiff[where] += turned.T @ k @ turned
        mass[where] += turned.T @ m @ turned
    for dof, value in inertias:
        mass[dof, dof] += value
    for a, b, value in masses:
        mass[a, a] += value
        mass[b, b] += value
    free = np.setdiff1d(np.arange(count), fixed)
    squares = scipy.linalg.eigh(
        stiff[np.ix_(free, free)], mass[np.ix_(free, free)], eigvals_only=True,
        subset_by_index=[0, min(11, len(free) - 1)],
    )  # fmt: skip
    return np.sqrt(np.maximum(squares, 0.0)) / (2 * np.pi)
