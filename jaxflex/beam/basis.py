"""The deflection shapes a link is allowed: raw shapes, turned tangent at the root and made orthogonal."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..brief import brief
from ..scalars import Scalar, scalar
from .boundary import Ends
from .eigen import whiten
from .mode_shapes import ModeShapes, solve_mode_shapes

QUADRATURE_POINTS = 48  # Gauss-Legendre: exact to rounding for the first ten modes

MODE_SHAPES = {
    "distal_mass_and_moment": "clamped, the distal mass at the tip, and on a link that carries "
    "another the static deflection under an end moment (default)",
    "clamped_mass": "clamped, the distal mass at the tip",
    "clamped_tip_mass": "clamped, the distal mass and inertia at the tip (Ahmad et al. (21)-(25))",
    "clamped_free": "clamped-free (Foldager et al. (8))",
    "pinned_free": "pinned-free, turned to be tangent at the root",
    "hinged_hub": "hinged with the hub inertia and a root spring, turned to be tangent at the root",
}


class Distal(eqx.Module):
    """What a link carries at its ends, as far as its shapes are concerned.

    **Fields** (shape `()`): `mass` [kg] and `inertia` [kg m^2] of all beyond the tip;
    `hub_inertia` [kg m^2] and `root_stiffness` [N m/rad] at the root, used by
    `hinged_hub` alone.
    """

    mass: Scalar
    inertia: Scalar
    hub_inertia: Scalar
    root_stiffness: Scalar

    __repr__ = brief


class Basis(eqx.Module):
    """Shapes `psi_k(x)` of one link, orthogonal in mass and in stiffness.

    The raw shapes are mode shapes, and with `end_moment` also `(x/l)^2`, the static
    deflection under a moment at the tip. A shape that is not tangent at the root has
    its root slope removed, `phi(x) - phi'(0) x`: with the joint's own rotation it spans
    the same motions, and the joint angle stays the angle of the hub. What gives way at the
    root, turning by `root_compliance` times the moment there, is then added to every
    shape: `c EI phi''(0) x`, the boundary condition of a sprung root.
    """

    modes: ModeShapes
    mixing: Float[Array, "raw shapes"]
    end_moment: bool = eqx.field(static=True)
    give: Scalar  # c EI [m]: root rotation for a unit of curvature there
    root_slope: Float[Array, " modes"]  # phi'(0) [1/m]
    root_curvature: Float[Array, " raw"]  # [1/m^2]

    def _mixed(self, modal: Array, moment: Array, turned: Array) -> Array:
        """Shapes of values `modal` and `moment` at points where a unit rotation of the root makes `turned`."""
        values = modal - turned[..., None] * self.root_slope
        if self.end_moment:
            values = jnp.concatenate([values, moment[..., None]], axis=-1)
        return (values + self.give * turned[..., None] * self.root_curvature) @ self.mixing

    def root_rotation(self) -> Float[Array, " shapes"]:
        """Rotation [rad] of the root against the hub for a unit of each shape."""
        return self.give * self.root_curvature @ self.mixing

    def deflection(self, x: Float[Array, "*points"]) -> Float[Array, "*points shapes"]:
        """`psi_k(x)`, dimensionless, at `x` [m] from the root."""
        return self._mixed(self.modes.deflection(x), (x / self.modes.length) ** 2, x)

    def slope(self, x: Float[Array, "*points"]) -> Float[Array, "*points shapes"]:
        """`psi_k'(x)` [1/m]."""
        return self._mixed(self.modes.slope(x), 2 * x / self.modes.length**2, jnp.ones_like(x))

    def curvature(self, x: Float[Array, "*points"]) -> Float[Array, "*points shapes"]:
        """`psi_k''(x)` [1/m^2]."""
        bent = jnp.full_like(x, 2 / self.modes.length**2)
        return self._mixed(self.modes.curvature(x), bent, jnp.zeros_like(x))


def quadrature(length: Scalar) -> tuple[Float[Array, " points"], Float[Array, " points"]]:
    """Gauss-Legendre points [m] and weights [m] on `[0, length]`."""
    points, weights = np.polynomial.legendre.leggauss(QUADRATURE_POINTS)
    return length * jnp.asarray((points + 1) / 2), length * jnp.asarray(weights / 2)


def orthogonalise(
    mass: Float[Array, "raw raw"], stiffness: Float[Array, "raw raw"], modal_mass: Scalar
) -> Float[Array, "raw raw"]:
    """Mixing V with `V^T mass V = modal_mass I` and `V^T stiffness V` diagonal, ascending."""
    factor, whitened = whiten(mass, stiffness)
    _, vectors = jnp.linalg.eigh(whitened)
    return jnp.sqrt(modal_mass) * jax.scipy.linalg.solve_triangular(factor.T, vectors, lower=False)


def make_basis(
    kind: str,
    modes: int,
    length: Scalar,
    mass_per_length: Scalar,
    flexural_rigidity: Scalar,
    distal: Distal,
    carries_link: bool,
    root_compliance: Scalar,
) -> Basis:
    """The basis named `kind` (a key of `MODE_SHAPES`) with `modes` mode shapes.

    Shapes are scaled to a modal mass equal to the mass of the link (as Ahmad et al. do:
    stiffness `omega^2 m_i`), the distal mass counted with them where the kind has one,
    and to a positive deflection at the tip. `root_compliance` [rad/(N m)] lies between
    hub and root.

    **Raises** `ValueError` for an unknown kind.
    """
    if kind not in MODE_SHAPES:
        allowed = ", ".join(MODE_SHAPES)
        raise ValueError(f"mode_shapes = {kind!r} is unknown; allowed are {allowed}.")
    link_mass = mass_per_length * length
    zero = scalar(0.0)
    tip_mass, tip_inertia, root, hub = zero, zero, None, None
    if kind in ("distal_mass_and_moment", "clamped_mass", "clamped_tip_mass"):
        tip_mass = distal.mass
    if kind == "clamped_tip_mass":
        tip_inertia = distal.inertia
    if kind == "pinned_free":
        root, hub = zero, zero
    if kind == "hinged_hub":
        root, hub = distal.root_stiffness, distal.hub_inertia
    rotary = link_mass * length**2
    ends = Ends(
        root_stiffness=None if root is None else root * length / flexural_rigidity,
        hub_inertia=None if hub is None else hub / rotary,
        tip_mass=tip_mass / link_mass,
        tip_inertia=tip_inertia / rotary,
    )
    shapes = solve_mode_shapes(length, ends, modes)
    end_moment = kind == "distal_mass_and_moment" and carries_link
    give = root_compliance * flexural_rigidity
    root_curvature = shapes.curvature(zero)
    if end_moment:
        root_curvature = jnp.append(root_curvature, 2 / length**2)
    raw = Basis(shapes, jnp.eye(modes + end_moment), end_moment, give, shapes.slope(zero), root_curvature)

    points, weights = quadrature(length)
    phi, bend = raw.deflection(points), raw.curvature(points)
    tip, tip_slope = raw.deflection(length), raw.slope(length)
    mass = (
        mass_per_length * (phi.T * weights) @ phi
        + tip_mass * jnp.outer(tip, tip)
        + tip_inertia * jnp.outer(tip_slope, tip_slope)
    )
    moment = flexural_rigidity * root_curvature
    stiffness = flexural_rigidity * (bend.T * weights) @ bend + root_compliance * jnp.outer(moment, moment)
    mixing = orthogonalise(mass, stiffness, link_mass)
    upward = jnp.where(tip @ mixing < 0, -1.0, 1.0)
    return dataclasses.replace(raw, mixing=mixing * upward)
