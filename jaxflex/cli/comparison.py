"""The designs that `jaxflex tune` compares, and how each fares on every payload."""

import dataclasses
from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np

from controllers import (
    CLASSICAL,
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
HALF = 2 + len(CLASSICAL)  # designs that owe nothing to a tuning; as many do


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


@dataclasses.dataclass
class Contest:
    """What the designs are compared in: a move on the arm as given, stretched to `total` [s], over payloads.

    These are `masses` [kg] and those halfway between them; the search saw those `chosen`. Shapers are
    padded to `impulses` and designs to `HALF`, so that one program serves before and after a tuning.
    """

    arm: Arm
    masses: list[float]
    chosen: list[float]
    path: Move
    total: float
    impulses: int

    def untuned(self) -> dict[str, Design]:
        """The designs that owe nothing to the tuning."""
        gains = textbook_pd(self.arm, jnp.stack(self.path.stop))
        designs = {
            UNTUNED: unshaped_design(gains, self.path),
            STRETCHED: unshaped_design(gains, self.path, self.total),
        }
        return designs | classical_designs(self.arm, gains, self.path, self.total)

    def tuned(self, design: Design) -> dict[str, Design]:
        """The tuned design, and others with its gains."""
        gains = design.controller
        designs = {"tuned PD, equal time": unshaped_design(gains, self.path, self.total)}
        for name, rival in classical_designs(self.arm, gains, self.path, self.total).items():
            designs[f"{name}, tuned PD"] = rival
        return designs | {TUNED: design}

    def payloads(self) -> np.ndarray:
        """All payloads [kg], rising."""
        between = [(a + b) / 2 for a, b in pairwise(self.masses)]
        return np.array(sorted(self.masses + between))

    def held(self, designs: dict[str, Design]) -> Comparison:
        """These designs on every payload."""
        payloads = self.payloads()
        held_out = ~np.isin(payloads, self.chosen)
        if not held_out.any():
            held_out[:] = True  # a single payload: it is all there is to judge by
        watch = 2.0 / float(locked_frequencies(self.arm, jnp.stack(self.path.stop))[0])
        times = jnp.linspace(0.0, self.total + watch, 1201)
        given = list(designs.values())
        full = given + [given[-1]] * (HALF - len(given))
        batch = stack(full, self.impulses), with_payloads(self.arm, jnp.asarray(payloads))
        found = jax.tree_util.tree_map(
            lambda x: jnp.asarray(np.asarray(x)[: len(given)]), assess(*batch, times)
        )
        return Comparison(designs, payloads, held_out, *found)


def together(one: Comparison, other: Comparison) -> Comparison:
    """The designs of both; raises `SimulationError` where one could not be simulated."""
    assessment, trajectory = jax.tree_util.tree_map(
        lambda *rows: jnp.asarray(np.concatenate(rows)),  # by numpy, which compiles nothing
        (one.assessment, one.trajectory),
        (other.assessment, other.trajectory),
    )
    trajectory.check()
    return Comparison(one.designs | other.designs, one.payloads, one.held_out, assessment, trajectory)


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
