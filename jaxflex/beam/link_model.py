"""A link seen from the arm: the constants that its deflection shapes leave behind.

Once the shapes are chosen, a link enters the energies only through a handful of
integrals. They are computed once for an arm, never inside the equations of motion. The assumed-modes link and the
lumped-parameter link differ in nothing but how they arrive at these numbers.
"""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..scalars import Scalar, ScalarLike, dot, scalar
from .basis import Basis, orthogonalise, quadrature


class LinkModel(eqx.Module):
    """Inertia, stiffness and damping of a link with deflection `w = sum psi_k(x) eta_k`.

    **Fields** (scalars, or tuples of them over the shapes k):

    - `length` [m]
    - `mass` `int rho dx` [kg], `first_moment` `int rho x dx` [kg m],
      `second_moment` `int rho x^2 dx` [kg m^2]
    - `deflection_integral` `int rho psi_k dx` [kg]
    - `rotation_integral` `int rho x psi_k dx` [kg m]
    - `modal_inertia` `int rho psi_j psi_k dx` [kg], a tuple of rows
    - `stiffness` `int EI psi_k'' psi_k'' dx` [N/m]; `damping` [N s/m]
    - `tip_deflection` `psi_k(l)`; `tip_slope` `psi_k'(l)` [1/m];
      `gauge_curvature` `psi_k''` at the strain gauge [1/m^2]
    - `joint_twist`: rotation [rad] of the link's root against the motor, for which the
      joint's spring or play gives way; `loose`: the last shape is the play
    - `shortening`: what bending takes off the length and, where that counts, a turn of the root; or None
    - `shown`: what the instrument of the tip's deflection shows of every shape, if that is not
      the deflection itself
    """

    length: Scalar
    mass: Scalar
    first_moment: Scalar
    second_moment: Scalar
    deflection_integral: tuple[Scalar, ...]
    rotation_integral: tuple[Scalar, ...]
    modal_inertia: tuple[tuple[Scalar, ...], ...]
    stiffness: tuple[Scalar, ...]
    damping: tuple[Scalar, ...]
    tip_deflection: tuple[Scalar, ...]
    tip_slope: tuple[Scalar, ...]
    gauge_curvature: tuple[Scalar, ...]
    joint_twist: tuple[Scalar, ...] = ()
    shortening: "Shortening | None" = None
    loose: bool = eqx.field(static=True, default=False)
    shown: tuple[Scalar, ...] | None = None

    @property
    def shapes(self) -> int:
        """Number of deflection coordinates of the link."""
        return len(self.stiffness)


class Shortening(eqx.Module):
    """How much shorter a bent link is: `s(x) = 1/2 eta^T S(x) eta`, `S = int_0^x psi' psi'^T`.

    Rows of `S` at the tip [1/m], of `int rho S dx` [kg/m], and of `int rho x S dx` [kg].
    """

    tip: tuple[tuple[Scalar, ...], ...]
    mean: tuple[tuple[Scalar, ...], ...]
    moment: tuple[tuple[Scalar, ...], ...]


def half_form(rows: tuple[tuple[Scalar, ...], ...], a: tuple, b: tuple) -> Scalar | float:
    """`1/2 a^T rows b` over scalars."""
    return 0.5 * dot(a, tuple(dot(row, b) for row in rows))


def symmetric_form(rows: tuple[tuple[Scalar, ...], ...], a: tuple) -> Scalar | float:
    """`a^T rows a` over scalars, of which only the upper triangle is read: half the work of all of it."""
    total = 0.0
    for j, row in enumerate(rows):
        total = total + a[j] * (row[j] * a[j] + 2 * dot(row[j + 1 :], a[j + 1 :]))
    return total


def rigid_link(length: Scalar, mass: Scalar, loose: bool = False, keeps_length: bool = False) -> LinkModel:
    """A uniform link that does not bend (the limit of rising stiffness).

    A `loose` one has a single shape, its rotation in the play of the joint; of no length and
    mass it is what a motor axis drives. `keeps_length`: its turn is followed to second order.
    """
    first, second = mass * length / 2, mass * length**2 / 3
    none: tuple[Scalar, ...] = ()
    if not loose:
        return LinkModel(length, mass, first, second, none, none, (), none, none, none, none, none)
    zero, one = (jnp.zeros_like(length),), (jnp.ones_like(length),)
    return LinkModel(
        length, mass, first, second, (first,), (second,), ((second,),), zero, zero, (length,), one, zero, one,
        shortening=Shortening(((length,),), ((first,),), ((second,),)) if keeps_length else None, loose=True,
    )  # fmt: skip


def modal_damping(
    stiffness: Sequence[Scalar],
    modal_mass: Scalar,
    damping_ratio: tuple[Scalar, ...] | str,
) -> tuple[Scalar, ...]:
    """Damping coefficients D_k [N s/m] of the modal coordinates.

    `2 zeta_k sqrt(K_k m)` for damping ratios (the last one given serves the higher
    modes), or `0.1 sqrt(K_k)` for `"ahmad"` (Ahmad et al., below (27)).
    """
    if damping_ratio == "ahmad":
        return tuple(0.1 * jnp.sqrt(k) for k in stiffness)
    ratios = tuple(damping_ratio[min(j, len(damping_ratio) - 1)] for j in range(len(stiffness)))
    return tuple(2 * z * jnp.sqrt(k * modal_mass) for z, k in zip(ratios, stiffness, strict=True))  # type: ignore[operator]


def assumed_modes_link(
    basis: Basis,
    mass_per_length: Scalar,
    flexural_rigidity: Scalar,
    damping_ratio: tuple[Scalar, ...] | str,
    gauge_position: Scalar,
    joint_compliance: ScalarLike = 0.0,
    shortening: Scalar | None = None,
    loose: bool = False,
) -> LinkModel:
    """The link whose deflection is a sum over `basis` (Ahmad et al. (19), Foldager et al. (8)).

    `joint_compliance` [rad/(N m)] is the joint's part of the basis' root compliance;
    `shortening` the share of what bending takes off the length that is counted, beside what
    a turn of the root takes off (None: neither is); a `loose` link has one more shape, the
    rotation of its root in the play of the joint.
    """
    length = basis.modes.length
    points, weights = quadrature(length)
    psi, bend = basis.deflection(points), basis.curvature(points)
    rho = mass_per_length * weights
    mass = mass_per_length * length
    root = basis.root_rotation()
    springs = jnp.sum(flexural_rigidity * weights[:, None] * bend**2, axis=0)
    moment = flexural_rigidity * basis.curvature(jnp.zeros_like(length))
    springs = springs + basis.give / flexural_rigidity * moment**2
    stiffness = tuple(springs)
    damping = modal_damping(stiffness, mass, damping_ratio)
    tip, tip_slope = basis.deflection(length), basis.slope(length)
    gauge = basis.curvature(gauge_position)
    # the twist of the joint is the joint's share of what the root gives
    some = basis.give > 0
    share = jnp.where(
        some, scalar(joint_compliance) * flexural_rigidity / jnp.where(some, basis.give, 1.0), 0.0
    )
    twist = share * root
    if loose:
        psi = jnp.column_stack([psi, points])
        tip, tip_slope = jnp.append(tip, length), jnp.append(tip_slope, 1.0)
        gauge, twist = jnp.append(gauge, 0.0), jnp.append(twist, 1.0)
        stiffness, damping = (*stiffness, jnp.zeros_like(length)), (*damping, jnp.zeros_like(length))
    return LinkModel(
        length=length,
        mass=mass,
        first_moment=mass * length / 2,
        second_moment=mass * length**2 / 3,
        deflection_integral=tuple(rho @ psi),
        rotation_integral=tuple((rho * points) @ psi),
        modal_inertia=_rows((psi.T * rho) @ psi),
        stiffness=stiffness,
        damping=damping,
        tip_deflection=tuple(tip),
        tip_slope=tuple(tip_slope),
        gauge_curvature=tuple(gauge),
        joint_twist=tuple(twist),
        shortening=None if shortening is None else _shortening(basis, mass_per_length, shortening, loose),
        loose=loose,
    )


def _shortening(basis: Basis, mass_per_length: Scalar, share: Scalar, loose: bool) -> Shortening:
    """What the turn of the root takes off in full, and `share` of what bending does beyond it.

    A link that turns at its root keeps its length: left out, that would soften the root by the
    link's inertia times the square of the rate at which the joint turns.
    """
    length = basis.modes.length
    points, weights = quadrature(length)

    def slopes(x):
        slope = basis.slope(x)
        return jnp.column_stack([slope, jnp.ones_like(x)]) if loose else slope

    root = slopes(jnp.zeros(1))

    def upto(x):
        inner, inner_weights = points * x / length, weights * x / length
        slope = slopes(inner)
        bend = slope - root
        return (slope.T * inner_weights) @ slope - (1 - share) * (bend.T * inner_weights) @ bend

    at = jax.vmap(upto)(points)
    rho = mass_per_length * weights
    return Shortening(
        tip=_rows(upto(length)),
        mean=_rows(jnp.einsum("p,pij->ij", rho, at)),
        moment=_rows(jnp.einsum("p,pij->ij", rho * points, at)),
    )


def _rows(matrix: Float[Array, "shapes shapes"]) -> tuple[tuple[Scalar, ...], ...]:
    return tuple(tuple(row) for row in matrix)


def lumped_link(
    length: Scalar,
    mass_per_length: Scalar,
    flexural_rigidity: Scalar,
    damping_ratio: tuple[Scalar, ...] | str,
    gauge_position: Scalar,
    segments: int,
    modes: int | None,
    tip_mass: Scalar,
    root_compliance: ScalarLike = 0.0,
    joint_compliance: ScalarLike = 0.0,
) -> LinkModel:
    """The lumped-parameter link of Foldager et al. (section 4): masses on massless springs.

    The link is cut into `segments` equal parts, each with its mass at its middle; a
    torsion spring `EI / h` joins one part to the next, and half a part, `2 EI / h`,
    joins the first to the root. The springs' angles are the physical coordinates; they
    are turned into the modes of the clamped chain with `tip_mass` [kg] at its end (all
    of them, or the `modes` lowest), an exact change of coordinates that makes stiffness
    and damping diagonal. Hub inertia, and the root spring that stands for a controller,
    belong to the joint.

    **Raises** `ValueError` if there are fewer segments than modes.
    """
    if modes is not None and modes > segments:
        raise ValueError(
            f"a lumped link with segments = {segments} has no more than {segments} modes, "
            f"{modes} were asked for; raise segments or lower modes."
        )
    h = length / segments
    index = jnp.arange(segments)
    middle = (index + 0.5) * h
    # spring j sits at x = j h; a unit angle there lifts all that lies beyond it
    lift = jnp.maximum(middle[:, None] - index[None, :] * h, 0.0)
    tip_lift = length - index * h
    mass = mass_per_length * length
    point_mass = mass / segments
    give = scalar(root_compliance) + scalar(joint_compliance)  # in series with the first spring
    springs = 1 / (jnp.where(index == 0, 0.5, 1.0) * h / flexural_rigidity + jnp.where(index == 0, give, 0.0))
    inertia = point_mass * lift.T @ lift
    mixing = orthogonalise(inertia + tip_mass * jnp.outer(tip_lift, tip_lift), jnp.diag(springs), mass)
    mixing = mixing[:, :modes]
    mixing = mixing * jnp.where(tip_lift @ mixing < 0, -1.0, 1.0)
    psi = lift @ mixing
    stiffness = tuple(springs @ mixing**2)
    # curvature at the gauge: the angle of its spring spread over the length that it stands for
    angles = mixing * (springs * jnp.where(index == 0, 0.5, 1.0) * h / flexural_rigidity)[:, None]
    bends = angles / jnp.where(index == 0, h / 2, h)[:, None]
    stations = jnp.where(index == 0, h / 4, index * h)
    gauge = jax.vmap(lambda column: jnp.interp(gauge_position, stations, column), 1)(bends)
    return LinkModel(
        length=length,
        mass=mass,
        first_moment=mass * length / 2,
        second_moment=point_mass * jnp.sum(middle**2),
        deflection_integral=tuple(point_mass * psi.sum(axis=0)),
        rotation_integral=tuple(point_mass * middle @ psi),
        modal_inertia=_rows(point_mass * psi.T @ psi),
        stiffness=stiffness,
        damping=modal_damping(stiffness, mass, damping_ratio),
        tip_deflection=tuple(tip_lift @ mixing),
        tip_slope=tuple(mixing.sum(axis=0)),
        gauge_curvature=tuple(gauge),
        joint_twist=tuple(scalar(joint_compliance) * springs[0] * mixing[0]),
    )
