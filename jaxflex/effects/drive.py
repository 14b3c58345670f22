"""Effects between the command and the torque: amplifier, winding, transport of the signal."""

from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import PyTree

from ..scalars import Scalar, scalar
from .base import AbstractDriveEffect


class VoltageSaturation(AbstractDriveEffect):
    """An amplifier that gives no more than `limit` [V] either way (0: no limit)."""

    limit: Scalar = eqx.field(converter=scalar)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "voltage_saturation"
    place: ClassVar[str] = "motor"
    units: ClassVar[dict[str, str]] = {"limit": "V"}
    looks_like: ClassVar[str] = "a voltage that is missing only while the command is large"

    def command(self, command: Scalar, memory: PyTree) -> Scalar:
        """`max(-V_max, min(V_max, V))` [V]."""
        bound = jnp.where(self.limit > 0, self.limit, jnp.inf)
        return jnp.clip(command, -bound, bound)


class VoltageDeadZone(AbstractDriveEffect):
    """An amplifier that loses the first `width` [V] of a command, `sign(V) max(|V| - w, 0)`."""

    width: Scalar = eqx.field(converter=scalar)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "voltage_dead_zone"
    place: ClassVar[str] = "motor"
    units: ClassVar[dict[str, str]] = {"width": "V"}
    looks_like: ClassVar[str] = "a voltage that is missing by the same amount for any command, with its sign"

    def command(self, command: Scalar, memory: PyTree) -> Scalar:
        """`sign(V) max(|V| - w, 0)` [V]."""
        return jnp.sign(command) * jnp.maximum(jnp.abs(command) - self.width, 0.0)


class InputDelay(AbstractDriveEffect):
    """A command that arrives late by `delay` tau [s], by the [1/2] Padé form of `exp(-tau s)`.

    `(1 - tau s / 3) / (1 + 2 tau s / 3 + (tau s)^2 / 6)`: exact to third order in
    `tau s`, and without a direct path, so that a step does not arrive at once.
    """

    delay: Scalar = eqx.field(converter=scalar)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "input_delay"
    place: ClassVar[str] = "joint"
    units: ClassVar[dict[str, str]] = {"delay": "s"}
    looks_like: ClassVar[str] = "an error that follows the slope of the command"

    def initial(self) -> PyTree:
        """Nothing under way."""
        return (jnp.zeros_like(self.delay), jnp.zeros_like(self.delay))

    def command(self, command: Scalar, memory: PyTree) -> Scalar:
        """The command as it was `delay` seconds ago."""
        level, slope = memory
        return jnp.where(self.delay > 0, level - slope / 3, command)

    def rate(self, command: Scalar, current: Scalar, motor: Any, memory: PyTree) -> PyTree:
        """`z' = w / tau`, `w' = 6 (u - z - 2 w / 3) / tau`."""
        level, slope = memory
        late = self.delay > 0
        per = jnp.where(late, 1 / jnp.where(late, self.delay, 1.0), 0.0)
        return (per * slope, 6 * per * (command - level - 2 * slope / 3))


class WindingHeating(AbstractDriveEffect):
    """A winding whose resistance rises as it warms: `R (1 + c H)`, `H' = R i^2 - H / tau`.

    `coefficient` c [1/J], temperature coefficient over heat capacity; `cooling_time` tau
    [s] (0: it keeps its heat). H [J] is the heat stored.
    """

    coefficient: Scalar = eqx.field(converter=scalar)
    cooling_time: Scalar = eqx.field(converter=scalar, default=0.0)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "winding_heating"
    place: ClassVar[str] = "motor"
    units: ClassVar[dict[str, str]] = {"coefficient": "1/J", "cooling_time": "s"}
    looks_like: ClassVar[str] = "a current that shrinks as the run goes on, in proportion to itself"

    def initial(self) -> PyTree:
        """A cold winding."""
        return jnp.zeros_like(self.coefficient)

    def motor(self, motor: Any, memory: PyTree) -> Any:
        """The motor with `R (1 + c H)`."""
        return eqx.tree_at(lambda m: m.resistance, motor, motor.resistance * (1 + self.coefficient * memory))

    def rate(self, command: Scalar, current: Scalar, motor: Any, memory: PyTree) -> PyTree:
        """`R i^2 - H / tau` [W]."""
        cools = self.cooling_time > 0
        per = jnp.where(cools, 1 / jnp.where(cools, self.cooling_time, 1.0), 0.0)
        return motor.resistance * current**2 - per * memory


class TorqueConstant(AbstractDriveEffect):
    """A motor whose torque constant is off by `change` [N m/A].

    `back_emf_share` of the same change, in V s/rad, goes to the back-EMF constant: 1 for
    weak magnets, 0 for a current sensor or a gear that is not what was said.
    """

    change: Scalar = eqx.field(converter=scalar)
    back_emf_share: Scalar = eqx.field(converter=scalar, default=0.0)
    location: str = eqx.field(static=True, default="joint_1")
    name: ClassVar[str] = "torque_constant"
    place: ClassVar[str] = "motor"
    units: ClassVar[dict[str, str]] = {"change": "N m/A", "back_emf_share": "1"}
    looks_like: ClassVar[str] = "a torque in proportion to the current"

    def motor(self, motor: Any, memory: PyTree) -> Any:
        """The motor with `K_m + change`."""
        constants = (
            motor.torque_constant + self.change,
            motor.back_emf_constant + self.back_emf_share * self.change,
        )
        return eqx.tree_at(lambda m: (m.torque_constant, m.back_emf_constant), motor, constants)
