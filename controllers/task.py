"""What a design is asked to do: a move on every arm of a batch, judged by its vibration, within limits.

The cost looks at the tip from the end of the commanded move on: its excursion about the
target, scenario by scenario, aggregated so that none is sacrificed. Logarithms make it
free of scale. Limits are constraints: each an excess that is to be no more than zero.
"""

from typing import NamedTuple

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from jaxflex import Arm, Fixed, Scalar, margins, peak, residual_vibration, scalar, tip_position

from .aggregate import AbstractAggregate, Blend
from .assess import run
from .designs import Design


class Outcome(NamedTuple):
    """What a tuning sees of a design.

    `cost`; `excess` of every constraint, kept where <= 0, and relative: 0.1 is ten per cent
    past the limit; `measures`, arrays by name that are worth knowing of the best design.
    """

    cost: Scalar
    excess: dict[str, Array] | None = None
    measures: dict[str, Array] | None = None


class Weights(eqx.Module):
    """What the cost is made of (dimensionless).

    - `aggregate`: how the scenarios count
    - `settling`: weight of the logarithm of the tip's rms distance from the target after
      the move, which tells a short excursion from one that goes on
    - `effort`: weight of the mean square voltage as a share of the limit
    """

    aggregate: AbstractAggregate = Blend()
    settling: float = 0.2
    effort: float = 0.05


class Limits(eqx.Module):
    """What a design must keep in every scenario; None for no limit.

    - `voltage`: peak as a share of the amplifier's limit, `current` [A]: peak
    - `deflection`: tip deflection as a share of the link's length; beyond a tenth the
      small-deflection model no longer holds, and a search that may leave it would
    - `move_time` [s] of the whole command, where a design may choose it
    - `gain` (a factor above 1), `phase` [rad] and `modulus` margins around every joint, and
      `decay` [1/s] of the slowest mode, of the loop made linear where the move ends;
      where a margin is limited the loop has to be stable as well
    """

    voltage: float | None = 0.9
    current: float | None = None
    deflection: float | None = 0.1
    move_time: float | None = None
    gain: float | None = None
    phase: float | None = None
    modulus: float | None = None
    decay: float | None = None

    def of_loop(self) -> bool:
        """True if a limit concerns the linear loop."""
        return any(limit is not None for limit in (self.gain, self.phase, self.modulus, self.decay))

    def loop_excess(self, arm: Arm, design: Design) -> dict[str, Array]:
        """Excess of the margins."""
        found = margins(arm, jnp.stack(design.move.stop), design.controller)
        least = 1e-3 if self.decay is None else self.decay
        excess = {"decay": 1 - found.decay / least}
        if self.gain is not None:
            # a loop may lose its stability by too much gain or by too little
            excess["gain"] = jnp.maximum(self.gain / found.gain, self.gain * found.gain_down) - 1
        if self.phase is not None:
            excess["phase"] = self.phase / found.phase - 1
        if self.modulus is not None:
            excess["modulus"] = self.modulus / found.modulus - 1
        return excess


class Task(eqx.Module):
    """A move, watched until well after its end, in every scenario.

    **Fields**: `arms`, batched, one a scenario; `watch` [s] after the commanded move;
    `samples` of the cost during the move and after it; `weights`; `limits`.
    """

    arms: Arm
    watch: Scalar = eqx.field(converter=scalar)
    samples: int = eqx.field(static=True, default=121)
    weights: Weights = Weights()
    limits: Limits = Limits()

    def outcome(self, design: Design) -> Outcome:
        """Cost and excesses of a design; the cost is infinite where a simulation fails."""
        weights, limits, end = self.weights, self.limits, design.move_time()
        during = jnp.linspace(0.0, 1.0, self.samples)[:-1] * end
        after = end + jnp.linspace(0.0, 1.0, self.samples) * self.watch
        times = jnp.concatenate([during, after])
        motors = [i for i, joint in enumerate(self.arms.joints, 1) if joint.motor is not None]
        bending = [i for i, link in enumerate(self.arms.links, 1) if link.modes]
        wanted = ["tip_x", "tip_y", *(f"voltage_{i}" for i in motors)]
        wanted += [f"tip_deflection_{i}" for i in bending]
        if limits.current is not None:
            wanted += [f"current_{i}" for i in motors]

        def one(arm):
            trajectory = run(
                design,
                arm,
                times,
                method=Fixed(),  # stability, not accuracy, sets the step here
                channels=wanted,
                max_steps=50_000,
                adjoint=diffrax.ForwardMode(),
            )
            target = tip_position(arm, jnp.stack(design.move.stop))
            travel = jnp.linalg.norm(target - tip_position(arm, jnp.stack(design.move.start)))
            late = trajectory.tip[self.samples - 1 :]
            excursion = residual_vibration(after, late, end, target)
            distance = jnp.sqrt(jnp.mean(jnp.sum((late - target) ** 2, axis=1)))
            effort, excess = jnp.zeros(()), {}
            for i in motors:
                limit = arm.joints[i - 1].motor.voltage_limit
                if limit is not None:
                    share = trajectory[f"voltage_{i}"] / limit
                    effort = effort + jnp.mean(share**2)
                    if limits.voltage is not None:
                        excess[f"voltage_{i}"] = peak(share) / limits.voltage - 1
                if limits.current is not None:
                    excess[f"current_{i}"] = peak(trajectory[f"current_{i}"]) / limits.current - 1
            if limits.deflection is not None:
                for i in bending:
                    bent = peak(trajectory[f"tip_deflection_{i}"]) / arm.links[i - 1].length
                    excess[f"deflection_{i}"] = bent / limits.deflection - 1
            if limits.of_loop():
                excess |= limits.loop_excess(arm, design)
            ok = trajectory.status == 0
            # a failed member counts as infinite, and its NaN must not reach the gradient
            measures = jnp.stack([excursion / travel, distance / travel])
            return jnp.where(ok, measures, jnp.inf), effort, excess, excursion

        (excursion, distance), effort, excess, residual = jax.vmap(one, out_axes=(1, 0, 0, 0))(self.arms)
        if limits.move_time is not None:
            excess["move_time"] = (end / limits.move_time - 1)[None]
        cost = (
            weights.aggregate(jnp.log(excursion))
            + weights.settling * jnp.mean(jnp.log(distance))
            + weights.effort * jnp.mean(effort)
        )
        return Outcome(cost, excess, {"residual_vibration": residual})
