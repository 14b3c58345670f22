"""The one-way model of Foldager et al. (9)-(12): the hub moves the link, the link does not move the hub."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Complex, Float

from ..beam.link_model import LinkModel
from ..motor import MotorAxis
from ..scalars import Scalar


class OneWayLink(eqx.Module):
    """Deflection of a link whose hub angle is given.

    `C_k eta_k'' + D_k eta_k' + G_k eta_k = -B_k theta''` for every mode k, with the
    modal mass C_k, stiffness G_k and `B_k = int rho x psi_k dx` of `link` (Foldager et
    al. (9), each term times rho A, modal damping added). The modes must be orthogonal
    in mass, so shapes without a tip mass, `clamped_free` above all.
    """

    link: LinkModel

    def _modal_mass(self) -> Float[Array, " modes"]:
        return jnp.stack([row[k] for k, row in enumerate(self.link.modal_inertia)])

    def accelerations(self, eta: tuple, eta_rate: tuple, hub_acceleration: Scalar) -> tuple:
        """`eta_k''` [m/s^2] for a hub acceleration [rad/s^2] (Foldager et al. (9))."""
        link = self.link
        return tuple(
            (
                -link.rotation_integral[k] * hub_acceleration
                - link.damping[k] * eta_rate[k]
                - link.stiffness[k] * eta[k]
            )
            / link.modal_inertia[k][k]
            for k in range(link.shapes)
        )

    def tip_over_angle(self, s: Complex[Array, "..."]) -> Complex[Array, "..."]:
        """`w(l, s) / theta(s) = -sum psi_k(l) B_k s^2 / (C_k s^2 + D_k s + G_k)` [m/rad] (Foldager (11))."""
        link = self.link
        s = s[..., None]
        tip, coupling = jnp.stack(link.tip_deflection), jnp.stack(link.rotation_integral)
        stiffness, damping = jnp.stack(link.stiffness), jnp.stack(link.damping)
        modal = self._modal_mass() * s**2 + damping * s + stiffness
        return -jnp.sum(tip * coupling * s**2 / modal, axis=-1)

    def tip_over_voltage(self, s: Complex[Array, "..."], axis: MotorAxis) -> Complex[Array, "..."]:
        """`w(l, s) / V_a(s)` [m/V], the motor `axis` before the link (Foldager (12))."""
        return self.tip_over_angle(s) * axis.open_loop(s)
