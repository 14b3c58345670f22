"""The models compared: coupled, lumped, and the paper's one-way model."""

from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import scipy.signal

import jaxflex as jf

from ..foldager import inferred_link

GAUGE = 0.06  # m from the root
MODES = 3


def with_gauge(arm: jf.Arm) -> jf.Arm:
    """The arm with its strain gauge at `GAUGE`."""
    return eqx.tree_at(lambda a: a.links[0].gauge_position, arm, jf.scalar(GAUGE))


def coupled(drive: str) -> jf.Arm:
    """The coupled assumed-modes model of the inferred link, commanded by `drive`."""
    return replace(with_gauge(inferred_link(modes=MODES)), drive=drive)


def lumped(drive: str, segments: int) -> jf.Arm:
    """The same as a lumped chain of `segments` masses."""
    return replace(with_gauge(inferred_link(model="lumped", segments=segments)), drive=drive)


def rigid(drive: str) -> jf.Arm:
    """Motor and hub with the link as a rigid body: what turns the hub of the one-way model."""
    return replace(inferred_link(modes=0), drive=drive)


def one_way() -> jf.OneWayLink:
    """The paper's one-way link, on its clamped-free shapes."""
    return jf.OneWayLink(coupled("current").assemble().links[0])


def rigid_axis(link_counted: bool) -> jf.MotorAxis:
    """The motor of (4): J is hub and rotor, and the rigid link with them if `link_counted`."""
    joint, link = rigid("voltage").joints[0], rigid("voltage").links[0]
    inertia = joint.hub_inertia + (link.mass * link.length**2 / 3 if link_counted else 0.0)
    return jf.MotorAxis(joint.motor, inertia, joint.viscous_friction)


def one_way_tip(times: np.ndarray, hub_rate: np.ndarray) -> np.ndarray:
    """Tip deflection [m] of the one-way model for a hub rate [rad/s] straight between its samples.

    With the momentum `p = C eta' + B theta'` of each mode, (9) reads `p' = -D eta' - G eta`
    and needs no hub acceleration, so a tachometer's reading can drive it.
    """
    link = one_way().link
    tip = np.zeros_like(times)
    for k in range(link.shapes):
        c, d, g = (float(v) for v in (link.modal_inertia[k][k], link.damping[k], link.stiffness[k]))
        b = float(link.rotation_integral[k])
        states = np.array([[0.0, 1 / c], [-g, -d / c]])
        inputs = np.array([[-b / c], [d * b / c]])
        system = (states, inputs, np.array([[float(link.tip_deflection[k]), 0.0]]), np.zeros((1, 1)))
        tip += scipy.signal.lsim(system, hub_rate, times)[1]
    return tip


def tip_from_strain(strain: np.ndarray) -> np.ndarray:
    """Tip deflection [m] that the gauge stands for if the link bends in its first clamped shape."""
    link = one_way().link
    thickness = float(coupled("current").links[0].thickness)
    return strain * float(link.tip_deflection[0]) / (thickness / 2 * float(link.gauge_curvature[0]))


def open_loop(drive: str = "voltage") -> tuple[np.ndarray, ...]:
    """`A, B, C, D` of the coupled model from its command to its tip deflection [m]."""
    linear = jf.linearise(coupled(drive), jnp.zeros(1), channels=("tip_deflection_1",))
    return tuple(np.asarray(matrix) for matrix in linear[:4])


def tip_over_voltage(frequencies: np.ndarray) -> np.ndarray:
    """`w / V_a` [m/V] of the coupled model at `frequencies` [Hz]."""
    a, b, c, _ = open_loop()
    one = np.eye(len(a))
    return np.array([(c @ np.linalg.solve(2j * np.pi * f * one - a, b))[0, 0] for f in frequencies])


def step_of_coupled(times: np.ndarray) -> np.ndarray:
    """Tip deflection [m] of the coupled model after a step of 1 V."""
    return scipy.signal.lsim(open_loop(), np.ones_like(times), times)[1]
