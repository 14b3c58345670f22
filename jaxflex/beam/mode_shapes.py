"""Mode shapes: the deflection that goes with each root of the frequency equation."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..scalars import Scalar
from .boundary import Ends, wave_numbers


class ModeShapes(eqx.Module):
    """Mode shapes phi_j of a uniform link (Ahmad et al. (21), Foldager et al. (8)).

    `phi_j(x) = A cos + B sin + C exp(-z x/l) + D exp(-z (1 - x/l))`, scaled so that its
    largest coefficient is one; what holds the ends decides z and the coefficients.

    **Fields**: `length` [m]; `wave_numbers` `z_j = beta_j l` `(modes,)`;
    `coefficients` `(modes, 4)`.
    """

    length: Scalar
    wave_numbers: Float[Array, " modes"]
    coefficients: Float[Array, "modes 4"]

    def _terms(self, x: Scalar) -> tuple[Array, Array, Array, Array]:
        z = self.wave_numbers
        xi = x / self.length
        return jnp.cos(z * xi), jnp.sin(z * xi), jnp.exp(-z * xi), jnp.exp(-z * (1 - xi))

    def deflection(self, x: Scalar) -> Float[Array, " modes"]:
        """`phi_j(x)`, dimensionless, at `x` [m] from the root."""
        c, s, e, f = self._terms(x)
        a, b, d, g = self.coefficients.T
        return a * c + b * s + d * e + g * f

    def slope(self, x: Scalar) -> Float[Array, " modes"]:
        """`phi_j'(x)` [1/m]."""
        c, s, e, f = self._terms(x)
        a, b, d, g = self.coefficients.T
        return self.wave_numbers / self.length * (-a * s + b * c - d * e + g * f)

    def curvature(self, x: Scalar) -> Float[Array, " modes"]:
        """`phi_j''(x)` [1/m^2]."""
        c, s, e, f = self._terms(x)
        a, b, d, g = self.coefficients.T
        return (self.wave_numbers / self.length) ** 2 * (-a * c - b * s + d * e + g * f)


def solve_mode_shapes(length: Scalar, ends: Ends, modes: int) -> ModeShapes:
    """The first `modes` mode shapes of a link of `length` [m] between `ends`."""
    z = wave_numbers(ends, modes)

    def coefficients(z):
        root, moment, shear = ends.conditions(z)
        # The null vector of a singular 3 x 3 matrix is the cross product of two of its rows;
        # of the three pairs, the one furthest from parallel is the accurate one.
        pairs = jnp.stack([jnp.cross(root, moment), jnp.cross(root, shear), jnp.cross(moment, shear)])
        best = jnp.argmax(jnp.sum(pairs**2, axis=1))
        a, b, d = pairs[best]
        full = jnp.stack([a, b, -a - d * jnp.exp(-z), d])
        return full / jnp.max(jnp.abs(full))

    return ModeShapes(length, z, jax.vmap(coefficients)(z))


def natural_frequencies(
    shapes: ModeShapes, mass_per_length: Scalar, flexural_rigidity: Scalar
) -> Float[Array, " modes"]:
    """`omega_j = z_j^2 sqrt(EI / (rho l^4))` [rad/s] (Foldager et al., below (8))."""
    stiffness = flexural_rigidity / (mass_per_length * shapes.length**4)
    return shapes.wave_numbers**2 * jnp.sqrt(stiffness)
