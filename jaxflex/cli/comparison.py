"""The designs that `jaxflex tune` compares, and how each fares on every payload."""

import dataclasses
from itertools import pairwise

import jax.numpy as jnp
import numpy as np

from controllers import (
    Assessment,
    Design,
    Move,
    assess,
    classical_designs,
    stack,
    textbook_pd,
    unshaped_design,
    with_payloads,
)

from ..analysis.frequencies import locked_frequencies
from ..arm.arm import Arm
from ..simulation.trajectory import Trajectory
from .tables import Table, number

UNTUNED, TUNED = "PD, untuned", "tuned"
STRETCHED = "PD, untuned, equal time"


@dataclasses.dataclass
class Comparison:
    """Every design on every payload: `held_out` marks the payloads that were not tuned on."""

    designs: dict[str, Design]
    payloads: np.ndarray
    held_out: np.ndarray
    assessment: Assessment
    trajectory: Trajectory

    def of(self, measure: str, name: str) -> np.ndarray:
        """One measure of one design, by payload."""
        return np.asarray(getattr(self.assessment, measure))[list(self.designs).index(name)]

    def worst(self, name: str) -> float:
        """Worst residual vibration [m] over the payloads that were not tuned on."""
        return float(np.max(self.of("residual_vibration", name)[self.held_out]))


def compare(
    arm: Arm, masses: list[float], chosen: list[float], path: Move, total: float, tuned: Design
) -> Comparison:
    """All designs on the arm as given, over the payloads asked for and those halfway between them."""
    pose = jnp.stack(path.stop)
    untuned = textbook_pd(arm, pose)
    designs = {UNTUNED: unshaped_design(untuned, path), STRETCHED: unshaped_design(untuned, path, total)}
    for name, design in classical_designs(arm, untuned, path, total).items():
        designs[name] = design
    designs["tuned PD, equal time"] = unshaped_design(tuned.controller, path, total)
    for name, design in classical_designs(arm, tuned.controller, path, total).items():
        designs[f"{name}, tuned PD"] = design
    designs[TUNED] = tuned
    between = [(a + b) / 2 for a, b in pairwise(masses)]
    payloads = np.array(sorted(masses + between))
    held_out = ~np.isin(payloads, chosen)
    if not held_out.any():
        held_out[:] = True  # a single payload: it is all there is to judge by
    watch = 2.0 / float(locked_frequencies(arm, pose)[0])
    times = jnp.linspace(0.0, total + watch, 1201)
    assessment, trajectory = assess(
        stack(list(designs.values())), with_payloads(arm, jnp.asarray(payloads)), times
    )
    trajectory.check()
    return Comparison(designs, payloads, held_out, assessment, trajectory)


def comparison_tables(comparison: Comparison) -> list[Table]:
    """One table a measure: designs down, payloads across; held-out payloads carry a star."""
    heads = [
        f"{1e3 * mass:.3g}{'*' if out else ''}"
        for mass, out in zip(comparison.payloads, comparison.held_out, strict=True)
    ]
    measures = [
        ("residual_vibration", "residual tip vibration after the move, peak to peak [mm]", 1e3),
        ("settling_time", "settling time of the tip into 1 % of its travel [s]", 1.0),
        ("overshoot", "overshoot of the tip [%]", 1.0),
        ("peak_voltage", "peak motor voltage [V]", 1.0),
        ("deflection", "largest tip deflection [% of the link's length]", 100.0),
    ]
    result = []
    for measure, title, scale in measures:
        table = Table(f"{title}; payload in g, * never tuned on", ["design", "move [s]", *heads], best=TUNED)
        for name, design in comparison.designs.items():
            values = comparison.of(measure, name) * scale
            table.rows.append([name, f"{float(design.move_time()):.2f}", *(number(float(v)) for v in values)])
        result.append(table)
    return result


def best_classical(comparison: Comparison) -> str | None:
    """The classical shaper with the tuned gains of least vibration at equal move time, if there is any."""
    names = [name for name in comparison.designs if name.endswith(", tuned PD")]
    return min(names, key=comparison.worst, default=None)
