"""The sweep that every program runs: a two-link arm turning under PD control, payload by payload."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

import jaxflex as jf
from controllers import PD, Move

DURATION = 2.0  # s
STOP, MOVE_TIME = (0.8, 0.5), 1.5  # rad, s
GAINS = PD(stiffness=(6.0, 2.0), damping=(2.0, 0.6))  # N m/rad, N m s/rad
SPAN = 1.0  # m, both links stretched


class Sweep(NamedTuple):
    """Arms with torque drives, one a payload, and what drives them all."""

    payloads: np.ndarray
    controller: PD
    move: Move

    def arm(self, payload) -> jf.Arm:
        """The arm with this payload [kg]."""
        return jf.ahmad_arm(payload, drive="torque", mode_shapes="clamped_tip_mass")

    def models(self) -> jf.AssembledArm:
        """All arms assembled, the payload on the leading axis."""
        return jax.vmap(lambda m: self.arm(m).assemble())(jnp.asarray(self.payloads))


def sweep(count: int) -> Sweep:
    """`count` arms with 0 to 100 g at the tip."""
    return Sweep(np.linspace(0.0, 0.1, count), GAINS, Move((0.0, 0.0), STOP, MOVE_TIME))
