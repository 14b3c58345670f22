"""How a design fares on an arm: the measures that `tune` compares, over payloads."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxflex import (
    AbstractMethod,
    Arm,
    Fixed,
    InitialState,
    Trajectory,
    electrical_energy,
    kept,
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
    all motors (zero without motors), `deflection` the largest tip deflection as a share
    of its link's length, `status` of the simulation.
    """

    residual_vibration: Float[Array, "*batch"]
    settling_time: Float[Array, "*batch"]
    overshoot: Float[Array, "*batch"]
    peak_voltage: Float[Array, "*batch"]
    energy: Float[Array, "*batch"]
    deflection: Float[Array, "*batch"]
    status: Array


def run(
    design: Design,
    arm: Arm,
    times: Float[Array, " times"],
    method: AbstractMethod | None = None,
    **options,
) -> Trajectory:
    """`arm` from rest at the start of the design's move, until the last of `times` [s].

    The default method suits loops in which stability sets the step; `options` as for
    `simulate`.
    """
    return simulate(
        arm,
        design.controller,
        design.reference,
        times,
        initial=InitialState(angles=jnp.stack(design.move.start)),
        method=method or Fixed(),
        **options,
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
    bends = [peak(trajectory[f"tip_deflection_{i}"]) / link.length for i, link in enumerate(arm.links, 1)]
    zero = jnp.zeros(())
    return Assessment(
        residual_vibration(times, tip, design.move_time(), target),
        settling_time(times, tip, target, SETTLED * travel),
        overshoot(along, 0.0, 1.0),
        jnp.max(jnp.stack([zero, *(peak(v) for v in voltages)])),
        sum((electrical_energy(times, v, i) for v, i in zip(voltages, currents, strict=True)), zero),
        jnp.max(jnp.stack([zero, *bends])),
        trajectory.status,
    )


def with_payloads(arm: Arm, payloads: Float[Array, " payloads"]) -> Arm:
    """`arm` with every payload mass [kg]: a batched arm for `vmap`."""
    return jax.vmap(arm.with_payload)(payloads)


def assessed_channels(arm: Arm) -> list[str]:
    """The channels that `assess` keeps: tip, deflections, what the motors do, acceleration of the last tip."""
    links = range(1, len(arm.links) + 1)
    motors = [i for i, joint in enumerate(arm.joints, 1) if joint.motor is not None]
    names = ["tip_x", "tip_y", *(f"tip_deflection_{i}" for i in links)]
    names += [f"{kind}_{i}" for i in motors for kind in ("voltage", "current")]
    return [*names, f"tip_acceleration_{len(arm.links)}"] if arm.links else names


@kept
def assess(designs: Design, arms: Arm, times: Float[Array, " times"]) -> tuple[Assessment, Trajectory]:
    """Every design of a batch on every arm of a batch; leading axes design, arm."""

    def one(design, arm):
        trajectory = run(design, arm, times, channels=assessed_channels(arm))
        return measure(design, arm, trajectory), trajectory

    over_arms = eqx.filter_vmap(one, in_axes=(None, eqx.if_array(0)))
    return eqx.filter_vmap(over_arms, in_axes=(eqx.if_array(0), None))(designs, arms)
