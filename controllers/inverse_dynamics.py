"""Control by the arm's own dynamics: feedforward of the torque a motion needs, and computed torque.

The links are taken as bent quasi-statically: `eta = -K^-1 f_eta`, with f_eta the forces
on the deflections of the rigid motion. Joints then follow up to the lowest mode with
joints locked. The tip is not inverted: from torque to tip a flexible link is not
minimum-phase, and an exact inverse would have to act before the motion begins.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import PyTree

from jaxflex import AbstractController, Arm, AssembledArm, Measurement, Scalar, Setpoint, inverse_dynamics

from .references import scalars


def joint_torques(model: AssembledArm, angles: tuple, rates: tuple, accelerations: tuple) -> tuple:
    """Torque [N m] of every joint for this motion of the joints, the links bent quasi-statically."""
    zeros = (jnp.zeros_like(angles[0]),) * (model.size - len(angles))
    rigid = inverse_dynamics(model, angles + zeros, rates + zeros, accelerations + zeros)
    bent = tuple(-f / k for f, k in zip(rigid[len(angles) :], model.stiffness()[len(angles) :], strict=True))
    forces = inverse_dynamics(model, angles + bent, rates + zeros, accelerations + zeros)
    return forces[: len(angles)]


def commands(model: AssembledArm, torques: tuple, rates: tuple) -> tuple:
    """Commands that make the motors give these torques at these joint rates, as the arm's drive wants them.

    Of a voltage the drop over the inductance is left out: it needs the torque's rate,
    and matters at the electrical time constant only.
    """
    if model.arm.drive == "torque":
        return torques
    found = []
    for joint, torque, rate in zip(model.joints, torques, rates, strict=True):
        motor = joint.motor
        assert motor is not None, "an arm with this drive has a motor at every joint"
        current = torque / motor.joint_torque(jnp.ones_like(torque))
        emf = -motor.armature_voltage(jnp.zeros_like(rate), rate)
        found.append(current if model.arm.drive == "current" else motor.resistance * current + emf)
    return tuple(found)


class InverseDynamics(AbstractController):
    """The command that the reference's motion needs; no feedback. Add it to a `PD` with `Sum`."""

    model: AssembledArm

    def __init__(self, arm: Arm):
        """`arm`: what is believed of the arm, its payload included."""
        self.model = arm.assemble()

    def initial(self) -> PyTree:
        """No memory."""
        return None

    def command(
        self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint
    ) -> tuple[Scalar, ...]:
        """Command of every joint."""
        torques = joint_torques(self.model, *setpoint)
        return commands(self.model, torques, setpoint.rate)

    def rate(self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint) -> PyTree:
        """No memory."""
        return None


class ComputedTorque(AbstractController):
    """The command for joint accelerations `theta_d'' + K_v (theta_d' - theta') + K_p (theta_d - theta)`.

    By the arm's dynamics at the angles and rates measured (Luh, Walker and Paul 1980), so
    that the joints of a rigid arm obey `e'' + K_v e' + K_p e = 0`; with links that bend,
    `sqrt(K_p)` has to stay well below the lowest frequency with joints locked.

    **Fields**: `stiffness` K_p [1/s^2] and `damping` K_v [1/s], one a joint; `model`.
    """

    model: AssembledArm
    stiffness: tuple[Scalar, ...] = eqx.field(converter=scalars)
    damping: tuple[Scalar, ...] = eqx.field(converter=scalars)

    def __init__(self, arm: Arm, stiffness, damping):
        """`arm`: what is believed of the arm, its payload included."""
        self.model, self.stiffness, self.damping = arm.assemble(), stiffness, damping

    def initial(self) -> PyTree:
        """No memory."""
        return None

    def command(
        self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint
    ) -> tuple[Scalar, ...]:
        """Command of every joint."""
        asked = tuple(
            setpoint.acceleration[i]
            + self.damping[i] * (setpoint.rate[i] - measurement.rate[i])
            + self.stiffness[i] * (setpoint.value[i] - measurement.angle[i])
            for i in range(len(self.stiffness))
        )
        torques = joint_torques(self.model, measurement.angle, measurement.rate, asked)
        return commands(self.model, torques, measurement.rate)

    def rate(self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint) -> PyTree:
        """No memory."""
        return None
