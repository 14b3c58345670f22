"""Mode shapes: the deflection that goes with each root of the frequency equation."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..scalars import Scalar
from .boundary import Ends, wave_numbers

# of the terms with (A, B, C, D): what stands with each of them in the derivative by z x/l
_DERIVATIVE = np.array([[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]])


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

    def _derivative(self, x: Array, order: int) -> Array:
        z, xi = self.wave_numbers, x[..., None] / self.length
        terms = jnp.stack([jnp.cos(z * xi), jnp.sin(z * xi), jnp.exp(-z * xi), jnp.exp(-z * (1 - xi))], -1)
        coefficients = self.coefficients @ np.linalg.matrix_power(_DERIVATIVE, order)
        return (z / self.length) ** order * jnp.sum(coefficients * terms, axis=-1)

    def deflection(self, x: Float[Array, "*points"]) -> Float[Array, "*points modes"]:
        """`phi_j(x)`, dimensionless, at `x` [m] from the root."""
        return self._derivative(x, 0)

    def slope(self, x: Float[Array, "*points"]) -> Float[Array, "*points modes"]:
        """`phi_j'(x)` [1/m]."""
        return self._derivative(x, 1)

    def curvature(self, x: Float[Array, "*points"]) -> Float[Array, "*points modes"]:
        """`phi_j''(x)` [1/m^2]."""
        return self._derivative(x, 2)


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
