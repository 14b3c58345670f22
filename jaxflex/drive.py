"""From a command to a torque at every joint: motors, amplifiers, friction and effects."""

from typing import NamedTuple

import jax.numpy as jnp

from .arm.arm import AssembledArm
from .effects import AbstractDriveEffect, AbstractJointEffect
from .scalars import Scalar


class DriveState(NamedTuple):
    """What the drives do at an instant, tuples over the joints.

    `voltage` [V] at the winding (zero where there is no motor), `current` [A],
    `torque` [N m] of the motor at the joint, `current_rate` [A/s] of the motors whose
    current is a state.
    """

    voltage: tuple
    current: tuple
    torque: tuple
    current_rate: tuple


def has_current_state(model: AssembledArm, joint: int) -> bool:
    """True if the joint's current is a state: a voltage drive and a motor with inductance."""
    motor = model.joints[joint].motor
    return model.arm.drive == "voltage" and motor is not None and motor.inductance is not None


def initial_currents(model: AssembledArm) -> tuple[Scalar, ...]:
    """Zero current [A] for every motor whose current is a state."""
    zero = jnp.zeros_like(model.arm.payload.mass)
    return tuple(zero for i in range(len(model.joints)) if has_current_state(model, i))


def currents_by_joint(model: AssembledArm, currents: tuple) -> tuple[Scalar, ...]:
    """Current [A] of every joint from those that are states, zero for the others."""
    states, zero = iter(currents), jnp.zeros_like(model.arm.payload.mass)
    return tuple(next(states) if has_current_state(model, i) else zero for i in range(len(model.joints)))


def drive(
    model: AssembledArm, command: tuple, currents: tuple, rates: tuple, memory: tuple | None = None
) -> DriveState:
    """Voltages, currents and torques that follow from `command` (Foldager et al. (1)-(3)).

    `currents` are those that are states; `rates` [rad/s] those of the joints; `memory`
    that of the drive effects. A voltage
    command is limited to the amplifier's range; a current or torque command is given as
    it is, and the voltage it takes is reported where there is a motor to tell.
    """
    voltages, all_currents, torques, current_rates = [], [], [], []
    states = iter(currents)
    for i, joint in enumerate(model.joints):
        motor, asked, rate = joint.motor, command[i], rates[i]
        for effect, kept in zip(drive_effects(model), memory or (), strict=True):
            if effect.index == i:
                asked, motor = effect.command(asked, kept), effect.motor(motor, kept)
        zero = jnp.zeros_like(asked)
        if model.arm.drive == "torque" or motor is None:
            voltage, current, torque = zero, zero, asked
            if motor is not None:
                current = asked / motor.joint_torque(jnp.ones_like(asked))
                emf = -motor.armature_voltage(zero, rate)
                voltage = motor.resistance * current + emf
        elif model.arm.drive == "current":
            current = asked
            voltage = motor.resistance * current - motor.armature_voltage(zero, rate)
            torque = motor.joint_torque(current)
        else:
            voltage = motor.limited(asked)
            if has_current_state(model, i):
                current = next(states)
                current_rates.append(motor.current_rate(current, voltage, rate))
            else:
                current = motor.static_current(voltage, rate)
            torque = motor.joint_torque(current)
        voltages.append(voltage)
        all_currents.append(current)
        torques.append(torque)
    return DriveState(tuple(voltages), tuple(all_currents), tuple(torques), tuple(current_rates))


def drive_effects(model: AssembledArm) -> tuple[AbstractDriveEffect, ...]:
    """The effects that act in the drives, in the order of the arm."""
    return tuple(e for e in model.arm.effects if isinstance(e, AbstractDriveEffect))


def initial_drive_memory(model: AssembledArm) -> tuple | None:
    """Memory of the drive effects at the start, one entry an effect; None if there are none."""
    return tuple(effect.initial() for effect in drive_effects(model)) or None


def drive_memory_rates(
    model: AssembledArm, command: tuple, drives: DriveState, memory: tuple | None
) -> tuple | None:
    """Time derivative of the memory of the drive effects."""
    if memory is None:
        return None
    return tuple(
        effect.rate(
            command[effect.index], drives.current[effect.index], model.joints[effect.index].motor, kept
        )
        for effect, kept in zip(drive_effects(model), memory, strict=True)
    )


def joint_effects(model: AssembledArm) -> tuple[AbstractJointEffect, ...]:
    """The effects that act as torques at the joints, in the order of the arm."""
    return tuple(e for e in model.arm.effects if isinstance(e, AbstractJointEffect))


def effect_torques(
    effects: tuple[AbstractJointEffect, ...],
    angles: tuple,
    rates: tuple,
    time: Scalar,
    memory: tuple | None = None,
) -> tuple[Scalar, ...]:
    """Sum of `effects` on every joint [N m]; `memory` has an entry an effect, None where none remembers."""
    torques = [jnp.zeros_like(rate) for rate in rates]
    for effect, kept in zip(effects, memory or (None,) * len(effects), strict=True):
        i, remembered = effect.index, () if kept is None else (kept,)
        torques[i] = torques[i] + effect(angles[i], rates[i], time, *remembered)
    return tuple(torques)


def initial_joint_memory(model: AssembledArm) -> tuple | None:
    """Memory of the joint effects at the start, one entry an effect; None if none remembers anything."""
    found = tuple(effect.initial() for effect in joint_effects(model))
    return None if all(memory is None for memory in found) else found


def joint_memory_rates(model: AssembledArm, rates: tuple, memory: tuple | None) -> tuple | None:
    """Time derivative of the memory of the joint effects at the `rates` of the joints [rad/s]."""
    if memory is None:
        return None
    pairs = zip(joint_effects(model), memory, strict=True)
    return tuple(effect.memory_rate(rates[effect.index], kept) for effect, kept in pairs)
