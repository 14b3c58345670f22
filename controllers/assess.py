"""How a design fares on an arm: the measures that `tune` compares, over payloads."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxflex import (
    AbstractMethod,
    Adaptive,
    Arm,
    InitialState,
    Trajectory,
    electrical_energy,
    overshoot,
    peak,
    residual_vibration,
    settling_time,
    simulate,
    tip_position,
)

from .designs import Design

SETTLED = 0.01  # share of the tip's travel within which it counts as settled


class Assessment(NamedTuple):
    """Measures of one run.

    `residual_vibration` [m] after the commanded move, `settling_time` [s] from the
    start of the move into one hundredth of the tip's travel, `overshoot` [%] of the
    tip along the line from start to target, `peak_voltage` [V] and `energy` [J] over
    all motors (zero without motors), `status` of the simulation.
    """

    residual_vibration: Float[Array, "*batch"]
    settling_time: Float[Array, "*batch"]
    overshoot: Float[Array, "*batch"]
    peak_voltage: Float[Array, "*batch"]
    energy: Float[Array, "*batch"]
    status: Array


def run(
    design: Design, arm: Arm, times: Float[Array, " times"], method: AbstractMethod | None = None
) -> Trajectory:
    """`arm` from rest at the start of the design's move, until the last of `times` [s]."""
    return simulate(
        arm,
        design.controller,
        design.reference,
        times,
        initial=InitialState(angles=jnp.stack(design.move.start)),
        method=method or Adaptive(rtol=1e-5, atol=1e-7),
    )


def measure(design: Design, arm: Arm, trajectory: Trajectory) -> Assessment:
    """The measures of a run of `design` on `arm`."""
    times, tip = trajectory.times, trajectory.tip
    start = tip_position(arm, jnp.stack(design.move.start))
    target = tip_position(arm, jnp.stack(design.move.stop))
    travel = jnp.linalg.norm(target - start)
    along = (tip - start) @ (target - start) / travel**2
    voltages = [v for name, v in trajectory.channels.items() if name.startswith("voltage_")]
    currents = [v for name, v in trajectory.channels.items() if name.startswith("current_")]
    zero = jnp.zeros(())
    return Assessment(
        residual_vibration(times, tip, design.move_time(), target),
        settling_time(times, tip, target, SETTLED * travel),
        overshoot(along, 0.0, 1.0),
        jnp.max(jnp.stack([zero, *(peak(v) for v in voltages)])),
        sum((electrical_energy(times, v, i) for v, i in zip(voltages, currents, strict=True)), zero),
        trajectory.status,
    )


def with_payloads(arm: Arm, payloads: Float[Array, " payloads"]) -> Arm:
    """`arm` with every payload mass [kg]: a batched arm for `vmap`."""
    return jax.vmap(arm.with_payload)(payloads)


@eqx.filter_jit
def assess(
    designs: Design, arms: Arm, times: Float[Array, " times"]
) -> tuple[Assessment, Trajectory]:
    """Every design of a batch on every arm of a batch; leading axes design, arm."""

    def one(design, arm):
        trajectory = run(design, arm, times)
        return measure(design, arm, trajectory), trajectory

    over_arms = eqx.filter_vmap(one, in_axes=(None, eqx.if_array(0)))
    return eqx.filter_vmap(over_arms, in_axes=(eqx.if_array(0), None))(designs, arms)
