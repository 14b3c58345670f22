"""The link on the bench: clamped, pinned, or held by the motor under its controller."""

from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np

import controllers as ctl
import jaxflex as jf

from ..foldager import inferred_link

GAUGE = 0.06  # m from the root: at the root itself a hinge leaves nothing to measure
STIFFNESS, DAMPING = 5.0, 0.05  # V/rad, V s/rad, of the PD
CLAMP = 1e3  # kg m^2, a hub too heavy to move
PIN = 1e-7  # kg m^2, a hub that weighs next to nothing: a lumped chain needs one
MODELS = {
    "coupled": dict(modes=5),
    "lumped": dict(model="lumped", segments=10),
}


def arm(model: str, support: str) -> jf.Arm:
    """The inferred link as `model`, its root `"clamped"`, `"pinned"` or `"driven"`."""
    made = inferred_link(**MODELS[model])
    made = eqx.tree_at(lambda a: a.links[0].gauge_position, made, jf.scalar(GAUGE))
    if support == "driven":
        return made
    hub = CLAMP if support == "clamped" else PIN
    bare = replace(made.joints[0], hub_inertia=hub, viscous_friction=0.0, motor=None)
    return replace(made, joints=(bare,), drive="torque")


class Rig(eqx.Module):
    """`x' = A x + b F`, strain = `c x`: the hammer's force F [N] on the tip in, the strain out."""

    A: np.ndarray
    b: np.ndarray
    c: np.ndarray

    def __init__(self, model: str, support: str):
        made = arm(model, support)
        controller = ctl.PD((STIFFNESS,), (DAMPING,)) if support == "driven" else None
        linear = jf.linearise(made, jnp.zeros(1), controller, ("strain_1",))
        assembled = made.assemble()
        size, link = assembled.size, assembled.links[0]
        # a force on the tip works on the joint with the whole length, on a shape with its deflection there
        push = jnp.stack([link.length, *link.tip_deflection])
        rates = jnp.linalg.solve(jf.mass_matrix(assembled, jnp.zeros(size)), push)
        self.A, self.c = np.asarray(linear.A), np.asarray(linear.C[0])
        self.b = np.zeros(len(self.A))
        self.b[size : 2 * size] = rates

    def modes(self, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
        """Frequencies [Hz] and damping ratios between `low` and `high` [Hz], from the poles."""
        poles = np.linalg.eigvals(self.A)
        poles = poles[poles.imag > 0]
        frequencies = np.abs(poles) / (2 * np.pi)
        inside = np.flatnonzero((frequencies > low) & (frequencies < high))
        order = inside[np.argsort(frequencies[inside])]
        return frequencies[order], -poles.real[order] / np.abs(poles[order])

    def response(self, frequencies: np.ndarray) -> np.ndarray:
        """`strain / F` [1/N] at `frequencies` [Hz]."""
        one = np.eye(len(self.A))
        return np.array(
            [self.c @ np.linalg.solve(2j * np.pi * f * one - self.A, self.b) for f in frequencies]
        )
