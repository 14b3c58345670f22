"""Natural frequencies of an arm, its joints free, locked or held by springs."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..arm.arm import Arm, AssembledArm
from ..arm.parts import Joint, Link
from ..beam.basis import make_basis
from ..beam.eigen import whiten
from ..beam.mode_shapes import natural_frequencies as beam_frequencies
from ..dynamics.lagrange import mass_matrix
from ..one_off import one_off
from ..scalars import scalar

JointVector = Float[Array, " joints"]


def undamped_frequencies(stiffness: Float[Array, "n n"], mass: Float[Array, "n n"]) -> Float[Array, " n"]:
    """`f` [Hz] of `K v = (2 pi f)^2 M v`, ascending; rigid-body motions have zero."""
    values = jnp.linalg.eigvalsh(whiten(mass, stiffness)[1])
    # rounding leaves a rigid body a square of either sign, and a root there has no slope
    elastic = values > 1e-13 * values[-1]
    return jnp.where(elastic, jnp.sqrt(jnp.where(elastic, values, 1.0)), 0.0) / (2 * jnp.pi)


def _stretched(model: AssembledArm, pose: JointVector | None) -> Float[Array, " coordinates"]:
    q = jnp.zeros(model.size)
    return q if pose is None else q.at[: len(model.joints)].set(pose)


def driven_frequencies(
    arm: Arm, pose: JointVector | None = None, joint_stiffness: JointVector | None = None
) -> Float[Array, " coordinates"]:
    """Undamped natural frequencies [Hz] with the joints free, rigid-body zeros included.

    `pose`: joint angles [rad] (default zeros, the arm stretched); `joint_stiffness`
    [N m/rad]: a spring at each joint, such as a stiff controller makes. Gravity's
    stiffness is left out. Shape `(coordinates,)`, ascending.
    """
    return _driven(arm.assemble(), pose, joint_stiffness)


@one_off
def _driven(
    model: AssembledArm, pose: JointVector | None, joint_stiffness: JointVector | None
) -> Float[Array, " coordinates"]:
    stiffness = jnp.stack(model.stiffness())
    if joint_stiffness is not None:
        stiffness = stiffness.at[: len(model.joints)].set(joint_stiffness)
    return undamped_frequencies(jnp.diag(stiffness), mass_matrix(model, _stretched(model, pose)))


def locked_frequencies(arm: Arm, pose: JointVector | None = None) -> Float[Array, " shapes"]:
    """Undamped natural frequencies [Hz] with all joints locked at `pose`. Shape `(shapes,)`."""
    return _locked(arm.assemble(), pose)


@one_off
def _locked(model: AssembledArm, pose: JointVector | None) -> Float[Array, " shapes"]:
    n = len(model.joints)
    if model.size == n:
        return jnp.zeros(0)
    mass = mass_matrix(model, _stretched(model, pose))[n:, n:]
    return undamped_frequencies(jnp.diag(jnp.stack(model.stiffness()[n:])), mass)


@one_off
def clamped_frequencies(arm: Arm, link: int) -> Float[Array, " modes"]:
    """Frequencies [Hz] of link `link` clamped at its root with all that hangs on it at its tip.

    Of an assumed-modes link these are the roots of the frequency equation of Ahmad et
    al. (23) with the distal mass and inertia; of a lumped link, those of its chain;
    of any other link, those of its own shapes.
    """
    part = arm.links[link]
    if part.modes == 0:
        return jnp.zeros(0)
    distal = arm.distal(link)
    if not isinstance(part, Link) or part.model == "lumped":
        constants = part.discretise(distal, link + 1 < len(arm.links), Joint())
        tip, slope = jnp.stack(constants.tip_deflection), jnp.stack(constants.tip_slope)
        mass = jnp.array(constants.modal_inertia) + distal.mass * jnp.outer(tip, tip)
        mass = mass + distal.inertia * jnp.outer(slope, slope)
        return undamped_frequencies(jnp.diag(jnp.stack(constants.stiffness)), mass)[: part.modes]
    basis = make_basis(
        "clamped_tip_mass", part.modes, part.length, part.mass_per_length,
        part.flexural_rigidity, distal, False, scalar(0.0),
    )  # fmt: skip
    omega = beam_frequencies(basis.modes, part.mass_per_length, part.flexural_rigidity)
    return omega / (2 * jnp.pi)
