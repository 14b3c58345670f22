"""Hub inertia, root stiffness and Young's modulus from the frequencies of Table 1.

Every residual is the logarithm of a computed over a measured frequency, all of equal
weight. What the readings leave open is found by fitting again readings drawn at random.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Complex, Float

import jaxflex as jf
from jaxflex.analysis.frequencies import undamped_frequencies

from ..foldager import CLAMPED_MEASURED, DRIVEN_MEASURED, YOUNGS_MODULUS_OF_THEORY

DRIVEN_DIGIT, CLAMPED_DIGIT = (1.0, 1.0), (0.1, 1.0, 1.0)  # Hz, last digits of Table 1
INERTIA, STIFFNESS = 5e-5, 1.0  # kg m^2 and N m/rad, units in which the unknowns are of order one
HYPOTHESES = ("theory", "clamped test", "all five")


class Table(NamedTuple):
    """Two driven and three clamped frequencies [Hz]."""

    driven: Float[Array, "2"]
    clamped: Float[Array, "3"]


class Boundary(NamedTuple):
    """`youngs_modulus` [Pa], `hub_inertia` [kg m^2] and `root_stiffness` [N m/rad]."""

    youngs_modulus: Array
    hub_inertia: Array
    root_stiffness: Array


class CoupledLink(eqx.Module):
    """The coupled assumed-modes model of the paper's link, its boundary free to choose.

    Mass and stiffness matrices are those without a hub; the hub's inertia and the root
    spring add to the joint's diagonal, and Young's modulus scales the rest.
    """

    mass: Float[Array, "n n"]
    stiffness: Float[Array, "n n"]

    def __init__(self, modes: int):
        model = jf.foldager_link(hub_inertia=0.0, modes=modes).assemble()
        self.mass = jf.mass_matrix(model, jnp.zeros(model.size))
        self.stiffness = jnp.diag(jnp.stack(model.stiffness()))

    def _matrices(self, boundary: Boundary) -> tuple[Array, Array]:
        mass = self.mass.at[0, 0].add(boundary.hub_inertia)
        scaled = self.stiffness * boundary.youngs_modulus / YOUNGS_MODULUS_OF_THEORY
        return scaled.at[0, 0].set(boundary.root_stiffness), mass

    def frequencies(self, boundary: Boundary) -> Float[Array, " n"]:
        """Frequencies [Hz] of the driven link, from that of the whole on its root spring upwards."""
        return undamped_frequencies(*self._matrices(boundary))

    def driven(self, boundary: Boundary) -> Float[Array, " modes"]:
        """Elastic frequencies [Hz] of the driven link: all but the lowest."""
        return self.frequencies(boundary)[1:]

    def poles(self, boundary: Boundary, hub_damping: Array) -> Complex[Array, " states"]:
        """Poles [rad/s] of the driven link with a damper [N m s/rad] at its hub and none in itself."""
        stiffness, mass = self._matrices(boundary)
        damping = jnp.zeros_like(mass).at[0, 0].set(hub_damping)
        zero, one = jnp.zeros_like(mass), jnp.eye(len(mass))
        rates = -jnp.linalg.solve(mass, jnp.hstack([stiffness, damping]))
        return jnp.linalg.eigvals(jnp.vstack([jnp.hstack([zero, one]), rates]))

    def clamped(self, youngs_modulus: Array) -> Float[Array, " modes"]:
        """Frequencies [Hz] of the clamped link."""
        scaled = self.stiffness * youngs_modulus / YOUNGS_MODULUS_OF_THEORY
        return undamped_frequencies(scaled[1:, 1:], self.mass[1:, 1:])


def _boundary(log_modulus, log_inertia, root):
    """From unknowns of order one; `root` is squared, so that the spring cannot push."""
    return Boundary(
        YOUNGS_MODULUS_OF_THEORY * jnp.exp(log_modulus), INERTIA * jnp.exp(log_inertia), STIFFNESS * root**2
    )


@eqx.filter_jit
def fit(link: CoupledLink, hypothesis: str, table: Table) -> Boundary:
    """The boundary that meets `table` best, its root stiffness not negative.

    `hypothesis` says where Young's modulus comes from: the paper's `"theory"`, the
    `"clamped test"`, or `"all five"` frequencies together with the boundary.
    """
    theory = link.clamped(jnp.asarray(YOUNGS_MODULUS_OF_THEORY))[:3]
    # frequencies go with the root of the modulus
    clamped_says = 2 * jnp.mean(jnp.log(table.clamped / theory))
    given = jnp.zeros(()) if hypothesis == "theory" else clamped_says
    free = hypothesis == "all five"

    def boundary(y):
        return _boundary(*y) if free else _boundary(given, *y)

    def residuals(y, _):
        b = boundary(y)
        of_driven = jnp.log(link.driven(b)[:2] / table.driven)
        of_clamped = jnp.log(link.clamped(b.youngs_modulus)[:3] / table.clamped)
        return jnp.concatenate([of_driven, of_clamped]) if free else of_driven

    start = jnp.array([0.0, 0.5])
    if free:
        start = jnp.concatenate([given[None], start])
    solver = optx.LevenbergMarquardt(rtol=1e-9, atol=1e-9)
    return boundary(optx.least_squares(residuals, solver, start, max_steps=400, throw=False).value)


def measured() -> Table:
    """Table 1 as printed."""
    return Table(jnp.asarray(DRIVEN_MEASURED), jnp.asarray(CLAMPED_MEASURED))


@eqx.filter_jit
def draws(link: CoupledLink, hypothesis: str, misfit: Array, count: int, seed: int = 0) -> Boundary:
    """Fits to `count` tables that might as well have been printed.

    Every reading is moved at random within half a unit of its last digit, and by a
    relative normal error of `misfit`, that of the model.
    """
    keys = jax.random.split(jax.random.key(seed), 4)

    def moved(values, last_digit, rounding, model):
        half, shape = jnp.asarray(last_digit) / 2, (count, len(last_digit))
        read = values + half * jax.random.uniform(rounding, shape, minval=-1.0)
        return read * jnp.exp(misfit * jax.random.normal(model, shape))

    table = measured()
    tables = Table(
        moved(table.driven, DRIVEN_DIGIT, *keys[:2]), moved(table.clamped, CLAMPED_DIGIT, *keys[2:])
    )
    return jax.vmap(lambda table: fit(link, hypothesis, table))(tables)


@eqx.filter_jit
def exact(link: CoupledLink, youngs_modulus: Array) -> tuple[Array, Array]:
    """Hub inertia and root stiffness, of either sign, that meet both driven frequencies exactly.

    **Returns** them as an array `(2,)` and their standard deviations, for readings
    uniform within half a unit of their last digit.
    """
    driven_hz, unit = measured().driven, jnp.array([INERTIA, STIFFNESS])

    def frequencies(y):
        return link.driven(Boundary(youngs_modulus, *(unit * y)))[:2]

    found = optx.root_find(
        lambda y, _: jnp.log(frequencies(y) / driven_hz), optx.Newton(1e-10, 1e-10), jnp.array([1.0, -0.5])
    ).value
    slope = jnp.linalg.inv(jax.jacfwd(frequencies)(found))
    reading = jnp.asarray(DRIVEN_DIGIT) / jnp.sqrt(12.0)
    return unit * found, unit * jnp.sqrt(jnp.sum((slope * reading) ** 2, axis=1))
