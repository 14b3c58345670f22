"""The closed loop as an ordinary differential equation over a pytree of scalars."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import jax.tree_util as jtu
from jaxtyping import PyTree

from ..arm.arm import AssembledArm
from ..control import AbstractController, AbstractReference, Measurement
from ..drive import (
    DriveState,
    currents_by_joint,
    drive,
    drive_memory_rates,
    effect_torques,
    initial_currents,
    initial_drive_memory,
    initial_joint_memory,
    joint_effects,
    joint_memory_rates,
)
from ..dynamics.lagrange import accelerations
from ..dynamics.simplify import simplified
from ..scalars import Scalar, dot
from ..sensors import measured_deflection


class State(NamedTuple):
    """State of the closed loop, every leaf a scalar (or one a saved time).

    `q` coordinates [rad], [m]; `qd` their rates; `current` [A] of the motors whose
    current is a state; `memory` of the controller; `held` command under sampled
    control; `drive` and `joint`: memory of the effects in the drives and at the joints. What
    there is none of is None.
    """

    q: tuple
    qd: tuple
    current: tuple | None
    memory: PyTree
    held: tuple | None
    drive: tuple | None = None
    joint: tuple | None = None


class Plant(eqx.Module):
    """An assembled arm with all that drives it."""

    model: AssembledArm
    controller: AbstractController
    reference: AbstractReference
    disturbance: AbstractReference | None
    sample_time: Scalar | None

    def rest(self, angles: tuple) -> State:
        """The arm at rest and undeflected, its joints at `angles` [rad]."""
        zero = jnp.zeros_like(angles[0])
        q = angles + (zero,) * (self.model.size - len(angles))
        held = None if self.sample_time is None else (zero,) * len(angles)
        currents, drives = initial_currents(self.model) or None, initial_drive_memory(self.model)
        joints = initial_joint_memory(self.model)
        return self.begun(State(q, (zero,) * len(q), currents, None, held, drives, joints))

    def begun(self, state: State) -> State:
        """`state` with the memory that the controller starts with there."""
        return state._replace(memory=self.controller.begin(self.measurement(state)))

    def measurement(self, state: State) -> Measurement:
        """What the controller reads of `state`, without error or delay."""
        angles, etas = self.model.split(state.q)
        rates, eta_rates = self.model.split(state.qd)
        links = self.model.links
        curvatures = tuple(map(lambda m, e: dot(m.gauge_curvature, e), links, etas))
        thicknesses = tuple(link.thickness for link in self.model.arm.links)
        return Measurement(
            angle=angles,
            rate=rates,
            current=currents_by_joint(self.model, state.current or ()),
            tip_deflection=tuple(map(measured_deflection, links, etas)),
            curvature=curvatures,
            curvature_rate=tuple(map(lambda m, e: dot(m.gauge_curvature, e), links, eta_rates)),
            strain=tuple(
                None if h is None else h / 2 * c for h, c in zip(thicknesses, curvatures, strict=False)
            ),
        )

    def command(self, t: Scalar, state: State) -> tuple:
        """Command the controller computes at `t` from `state`."""
        setpoint = self.reference.setpoint(t)
        return self.controller.command(t, state.memory, self.measurement(state), setpoint)

    def drives(self, t: Scalar, state: State) -> DriveState:
        """What the drives do at `t`, under the held command where control is sampled."""
        command = self.command(t, state) if state.held is None else state.held
        rates, _ = self.model.split(state.qd)
        return drive(self.model, command, state.current or (), rates, state.drive)

    def accelerations(self, t: Scalar, state: State, drives: DriveState) -> tuple:
        """`q''` of `M q'' + C q' + g + D q' = tau` (Ahmad et al. (27))."""
        angles, _ = self.model.split(state.q)
        rates, _ = self.model.split(state.qd)
        extra = effect_torques(joint_effects(self.model), angles, rates, t, state.joint)
        torques = tuple(map(lambda a, b: a + b, drives.torque, extra))
        if self.disturbance is not None:
            torques = tuple(map(lambda a, b: a + b, torques, self.disturbance(t)))
        zero = jnp.zeros_like(angles[0])
        torques = torques + (zero,) * (self.model.size - len(torques))
        damped = map(lambda d, v: d * v, self.model.damping(state.q), state.qd)
        force = tuple(map(lambda a, b: a - b, torques, damped))
        return accelerations(self.model, state.q, state.qd, force)

    def derivative(self, t: Scalar, state: State) -> State:
        """Time derivative of the state, of the same structure."""
        drives = self.drives(t, state)
        qdd = self.accelerations(t, state, drives)
        if self.sample_time is None:
            setpoint = self.reference.setpoint(t)
            memory = self.controller.rate(t, state.memory, self.measurement(state), setpoint)
        else:
            memory = jtu.tree_map(jnp.zeros_like, state.memory)
        held = None if state.held is None else tuple(jnp.zeros_like(h) for h in state.held)
        command = state.held
        if command is None and state.drive is not None:
            command = self.command(t, state)
        kept = drive_memory_rates(self.model, command or (), drives, state.drive)
        rates, _ = self.model.split(state.qd)
        bent = joint_memory_rates(self.model, rates, state.joint)
        return State(state.qd, qdd, drives.current_rate or None, memory, held, kept, bent)

    def sampled(self, t: Scalar, state: State) -> State:
        """The state just after a sample at `t`: command held anew, memory advanced one period."""
        setpoint = self.reference.setpoint(t)
        measurement = self.measurement(state)
        held = self.controller.command(t, state.memory, measurement, setpoint)
        assert self.sample_time is not None
        memory = self.controller.advance(self.sample_time, t, state.memory, measurement, setpoint)
        return state._replace(memory=memory, held=held)


@simplified
def derivative(t: Scalar, state: State, plant: Plant) -> State:
    """`plant.derivative(t, state)` as the solver calls it."""
    return plant.derivative(t, state)


def within(seen: tuple, t: Scalar) -> Scalar:
    """`t` within the two instants `seen`, the second if they are in the wrong order; slope 1 in `t`."""
    return t + jax.lax.stop_gradient(jnp.clip(t, *seen) - t)
