"""M, C and g by autodiff of `T - U` (Ahmad et al. (26)-(27)).

Two faces of one derivation. Over arrays, `mass_matrix`, `coriolis_matrix` and
`gravity_vector` are the textbook terms of `M q'' + C q' + g + D q' = tau`, for reading,
design and tests. Over scalars, `accelerations` is what the simulation calls: the same
derivatives without an array in sight, so that XLA fuses them and a batch of arms
becomes a struct of arrays.
"""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..arm.arm import AssembledArm
from ..arm.energy import kinetic_energy, potential_energy
from ..scalars import Scalar
from .ldl import solve
from .simplify import cleaned, simplified, traced

Coordinates = Float[Array, " coordinates"]
Matrix = Float[Array, "coordinates coordinates"]


def lagrangian(model: AssembledArm, q: Coordinates, qd: Coordinates) -> Scalar:
    """`L = T - U` [J]."""
    return kinetic_energy(model, tuple(q), tuple(qd)) - potential_energy(model, tuple(q))


@eqx.filter_jit
def mass_matrix(model: AssembledArm, q: Coordinates) -> Matrix:
    """`M = d^2 T / dq'^2`, symmetric positive definite, shape `(n, n)`."""
    return jax.hessian(lagrangian, argnums=2)(model, q, jnp.zeros_like(q))


def coriolis_matrix(model: AssembledArm, q: Coordinates, qd: Coordinates) -> Matrix:
    """`C_ij = sum_k 1/2 (dM_ij/dq_k + dM_ik/dq_j - dM_jk/dq_i) q'_k`, shape `(n, n)`.

    Christoffel symbols of the first kind, which make `dM/dt - 2 C` skew.
    """
    slope = jax.jacfwd(mass_matrix, argnums=1)(model, q)  # slope[i, j, k] = dM_ij / dq_k
    return 0.5 * (slope @ qd + jnp.einsum("ikj,k->ij", slope, qd) - jnp.einsum("jki,k->ij", slope, qd))


def gravity_vector(model: AssembledArm, q: Coordinates) -> Coordinates:
    """`g = dU/dq`: gravity and the links' stiffness, shape `(n,)`."""
    return jax.grad(lambda q: potential_energy(model, tuple(q)))(q)


def damping_vector(model: AssembledArm) -> Coordinates:
    """Diagonal of D: viscous friction of the joints, modal damping of the links, shape `(n,)`."""
    return jnp.stack(model.damping())


def _along_each(momentum: Callable, qd: tuple) -> list[list[Scalar]]:
    """Lower triangle of the derivative of `momentum`, a function of the rates, row by row."""
    size = len(qd)
    columns = []
    for j in range(size):
        # differentiating along one rate at a time lets autodiff drop all that does not
        # depend on it, which a vmap over unit vectors could not
        def along(rate, j=j):
            return momentum((*qd[:j], rate, *qd[j + 1 :]))

        columns.append(jax.jvp(along, (qd[j],), (jnp.ones_like(qd[j]),))[1])
    return [[columns[j][i] for j in range(i + 1)] for i in range(size)]


@simplified
def inertia(model: AssembledArm, q: tuple) -> list[list[Scalar]]:
    """Lower triangle of `M(q)` over scalars, row by row."""
    qd = tuple(jnp.zeros_like(x) for x in q)
    momentum = traced(jax.grad(kinetic_energy, argnums=2), model, q, qd)
    return _along_each(lambda qd: momentum(model, q, qd), qd)


def _momentum(model: AssembledArm, q: tuple, qd: tuple) -> tuple:
    return jax.grad(kinetic_energy, argnums=2)(model, q, qd)


def _generalised_force(model: AssembledArm, q: tuple, qd: tuple) -> tuple:
    """`dL/dq`."""
    return jax.grad(lambda q: kinetic_energy(model, q, qd) - potential_energy(model, q))(q)


@eqx.filter_custom_jvp
def accelerations(model: AssembledArm, q: tuple, qd: tuple, force: tuple) -> tuple[Scalar, ...]:
    """`q'' = M^-1 (force - bias)`, all tuples of scalars.

    The bias `d/dt(dL/dq')|_{q''=0} - dL/dq` holds Coriolis, centrifugal, gravity and
    elastic terms; `force` everything else (damping, friction, motors, disturbances).
    Its slope is `M dq'' = dforce - d(M q'' + bias)|_{q''}`: neither the inverse nor most
    of M is differentiated, which saves a third of the work of a slope.
    """
    return unrolled_accelerations(model, q, qd, force)


@simplified
def unrolled_accelerations(model: AssembledArm, q: tuple, qd: tuple, force: tuple) -> tuple[Scalar, ...]:
    """The same without a slope of its own."""
    return _accelerations(model, q, qd, force)


def _accelerations(model: AssembledArm, q: tuple, qd: tuple, force: tuple) -> tuple[Scalar, ...]:
    energy = traced(kinetic_energy, model, q, qd)
    momentum = traced(jax.grad(energy, argnums=2), model, q, qd)
    lower = _along_each(lambda qd: momentum(model, q, qd), qd)
    drift = jax.jvp(lambda q: momentum(model, q, qd), (q,), (qd,))[1]
    slope = jax.grad(lambda q: energy(model, q, qd) - potential_energy(model, q))(q)
    right = tuple(f - d + s for f, d, s in zip(force, drift, slope, strict=True))
    return solve(lower, right)


@accelerations.def_jvp
def _accelerations_along(primals, tangents):
    return _with_slope(primals, tangents)


@simplified
def _with_slope(primals, tangents):
    model, q, qd, force = primals
    qdd = _accelerations(model, q, qd, force)
    still = (None,) * len(qdd)
    _, moved = eqx.filter_jvp(cleaned(inertial_forces), (model, q, qd, qdd), (*tangents[:3], still))
    right = tuple(
        (jnp.zeros_like(a) if f is None else f) - (0.0 if m is None else m)
        for a, f, m in zip(qdd, tangents[3], moved, strict=True)
    )
    return qdd, solve(_along_each(lambda qd: _momentum(model, q, qd), qd), right)


def inertial_forces(model: AssembledArm, q: tuple, qd: tuple, qdd: tuple) -> tuple[Scalar, ...]:
    """`M q'' + C q' + g = d/dt(dL/dq') - dL/dq` under the accelerations `qdd`."""
    change = jax.jvp(lambda q, qd: _momentum(model, q, qd), (q, qd), (qd, qdd))[1]
    return tuple(c - s for c, s in zip(change, _generalised_force(model, q, qd), strict=True))


def inverse_dynamics(model: AssembledArm, q: tuple, qd: tuple, qdd: tuple) -> tuple[Scalar, ...]:
    """`M q'' + C q' + g + D q'`: the force on every coordinate that makes this motion.

    [N m] on the joints, [N] on the deflections, where a motion that is possible without
    other forces has none. From the Lagrangian: `d/dt(dL/dq') - dL/dq + D q'`.
    """
    damped = map(lambda d, v: d * v, model.damping(), qd)
    return tuple(f + d for f, d in zip(inertial_forces(model, q, qd, qdd), damped, strict=True))
