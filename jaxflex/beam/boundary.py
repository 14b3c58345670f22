"""Natural frequencies of a uniform Euler-Bernoulli link, whatever holds its ends.

A harmonic deflection of `EI w'''' = rho omega^2 w` (Ahmad et al. (15)) is, with
`z = beta l`, `omega^2 = EI z^4 / (rho l^4)` and `xi = x / l`,

    w(xi) = A cos(z xi) + B sin(z xi) + C exp(-z xi) + D exp(-z (1 - xi)).

The two decaying exponentials span the same space as `cosh` and `sinh` without
their cancellation, so that high modes stay accurate. The ends state

    root   w = 0    and    EI w'' = (k - omega^2 J_h) w'       hinge, hub J_h, spring k
                    or     w' = 0                              clamp
    tip    EI w'' = omega^2 J w'   and   EI w''' = -omega^2 M w   payload M, J

which gives, as special cases, the frequency equations of the papers: Ahmad (23) for
the clamp with tip mass and inertia, Foldager's `cosh cos = -1` for clamped-free, and
`tan z = tanh z` for pinned-free. The determinant of these conditions is the frequency
equation; its roots are found by bisection and differentiated implicitly.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..scalars import Scalar

GRID_PER_PI = 64  # points a half wave at which the frequency equation is sampled
HALVINGS = 50  # of a bracket, which leave no more than rounding
SMALLEST_ROOT = 5e-3  # below it lies only the rigid rotation of a free hinge


class Ends(eqx.Module):
    """What holds the two ends of a link, in units of the link itself.

    **Fields** (dimensionless, shape `()`):

    - `root_stiffness`: `k l / EI`; None for a clamp.
    - `hub_inertia`: `J_h / (rho l^3)`; None for a clamp.
    - `tip_mass`: `M / (rho l)`.
    - `tip_inertia`: `J / (rho l^3)`.
    """

    root_stiffness: Scalar | None
    hub_inertia: Scalar | None
    tip_mass: Scalar
    tip_inertia: Scalar

    def __check_init__(self):
        if (self.root_stiffness is None) != (self.hub_inertia is None):
            raise ValueError(
                "Ends: give both root_stiffness and hub_inertia for a hinge, or neither for a clamp."
            )

    def conditions(self, z: Scalar) -> Float[Array, "3 3"]:
        """Boundary conditions on (A, B, D); `w(0) = 0` has removed C = -A - D exp(-z)."""
        e, c, s = jnp.exp(-z), jnp.cos(z), jnp.sin(z)
        # rows: value or derivative at an end, divided by its power of z, as weights of (A, B, D)
        slope_0 = jnp.stack([jnp.ones_like(z), jnp.ones_like(z), 2 * e])
        moment_0 = jnp.stack([-2 * jnp.ones_like(z), jnp.zeros_like(z), jnp.zeros_like(z)])
        value_1 = jnp.stack([c - e, s, 1 - e * e])
        slope_1 = jnp.stack([e - s, c, 1 + e * e])
        moment_1 = jnp.stack([-c - e, -s, 1 - e * e])
        shear_1 = jnp.stack([s + e, -c, 1 + e * e])
        if self.root_stiffness is None or self.hub_inertia is None:
            root = slope_0
        else:
            spring, hub = self.root_stiffness, z**4 * self.hub_inertia
            root = (z * moment_0 - (spring - hub) * slope_0) / (1 + z + spring + hub)
        rotary, mass = z**3 * self.tip_inertia, z * self.tip_mass
        moment = (moment_1 - rotary * slope_1) / (1 + rotary)
        shear = (shear_1 + mass * value_1) / (1 + mass)
        return jnp.stack([root, moment, shear])


def frequency_equation(z: Scalar, ends: Ends) -> Scalar:
    """Determinant of the boundary conditions: zero where `z = beta l` is a natural mode."""
    root, moment, shear = ends.conditions(z)
    return jnp.dot(root, jnp.cross(moment, shear))


def wave_numbers(ends: Ends, modes: int) -> Float[Array, " modes"]:
    """The first `modes` roots `z = beta l` of the frequency equation, ascending.

    The equation is sampled on a grid, each sign change brackets a root, and a
    bisection closes it; gradients follow from the implicit function theorem, so they
    are those of the root and not of the iterations. The rigid rotation of a free hinge
    (z = 0) is not a mode and is left out.

    **Returns** shape `(modes,)`, dimensionless; NaN where the grid holds fewer roots,
    which no physical link reaches.
    """
    top = (modes + 1) * np.pi
    grid = jnp.asarray(np.linspace(SMALLEST_ROOT, top, GRID_PER_PI * (modes + 1) + 1))
    equations = jax.vmap(frequency_equation, (0, None))

    def bisected(equation, _):
        positive = equations(grid, ends) > 0
        crossing = positive[1:] != positive[:-1]
        found = crossing & (jnp.cumsum(crossing) == jnp.arange(1, modes + 1)[:, None])
        index = jnp.argmax(found, axis=1)
        below = positive[index]

        def halve(_, bracket):
            low, high = bracket
            middle = (low + high) / 2
            same = (equation(middle) > 0) == below
            return jnp.where(same, middle, low), jnp.where(same, high, middle)

        low, high = jax.lax.fori_loop(0, HALVINGS, halve, (grid[index], grid[index + 1]))
        return jnp.where(found.any(axis=1), (low + high) / 2, jnp.nan)

    def solved(slope, right):
        # every mode has an equation of its own, so that their Jacobian is diagonal
        return right / slope(jnp.ones_like(right))

    return jax.lax.custom_root(lambda z: equations(z, ends), jnp.zeros(modes), bisected, solved)
