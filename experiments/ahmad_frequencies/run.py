"""Frequencies of the two-link arm against payload, pose, number of modes and choice of shapes."""

from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import jaxflex as jf

from .finite_elements import arm_frequencies
from .pictures import plot_convergence, plot_effects

LIMIT = 48  # elements a link; half of them gives the same to 1e-5
COMPARED = 4  # elastic frequencies
HELD = {"joints free": False, "joints locked": True}


def exact(payload: float, bend: float, locked: bool, elements: int = LIMIT) -> np.ndarray:
    """The elastic frequencies [Hz] of the finite-element model."""
    rigid = 0 if locked else 2
    return arm_frequencies(payload, bend, elements, locked)[rigid : rigid + COMPARED]


def modal(
    payloads, bends, locked: bool, modes: int = 2, shapes: str = "distal_mass_and_moment"
) -> np.ndarray:
    """The same of the assumed-modes model, a row for each pair of payload [kg] and bend [rad]."""
    arm = jf.ahmad_arm(0.0, modes, shapes)
    rigid = 0 if locked else 2

    @jax.jit
    @jax.vmap
    def of(payload, bend):
        pose = jnp.stack([jnp.zeros_like(bend), bend])
        loaded = arm.with_payload(payload)
        found = jf.locked_frequencies(loaded, pose) if locked else jf.driven_frequencies(loaded, pose)
        return found[rigid : rigid + COMPARED]

    return np.asarray(of(jnp.asarray(payloads), jnp.asarray(bends)))


def effects(payloads, bends) -> dict[str, dict[str, dict[str, np.ndarray]]]:
    """Frequencies over payload (arm stretched) and over pose (50 g), modal and exact."""
    sweeps = {
        "payload": (payloads, np.zeros(len(payloads))),
        "pose": (np.full(len(bends), 0.05), bends),
    }
    return {
        name: {
            held: {
                "modal": modal(*sweep, locked),
                "exact": np.array([exact(m, b, locked) for m, b in zip(*sweep, strict=True)]),
            }
            for held, locked in HELD.items()
        }
        for name, sweep in sweeps.items()
    }


def convergence(kinds, counts) -> dict[str, dict[str, list[float]]]:
    """Worst error [%] of four frequencies (50 g, second joint at 0 and at 90 deg) by kind and number of modes."""
    payloads, bends = [0.05, 0.05], [0.0, np.pi / 2]
    table: dict[str, dict[str, list[float]]] = {}
    for held, locked in HELD.items():
        limit = np.array([exact(m, b, locked) for m, b in zip(payloads, bends, strict=True)])
        table[held] = {
            kind: [
                float(100 * np.max(np.abs(modal(payloads, bends, locked, count, kind) / limit - 1)))
                for count in counts
            ]
            for kind in kinds
        }
    return table


def run(folder: Path, reduced: bool) -> dict[str, Any]:
    """What do payload, pose, modes and mode shapes do to the natural frequencies, and are they exact?"""
    payloads = np.array([0.0, 0.1]) if reduced else np.linspace(0.0, 0.1, 6)
    bends = np.deg2rad([0.0, 90.0]) if reduced else np.deg2rad(np.linspace(0.0, 180.0, 13))
    found = effects(payloads, bends)
    kinds = ["distal_mass_and_moment", "clamped_tip_mass"] if reduced else list(jf.MODE_SHAPES)
    counts = [2] if reduced else [2, 3, 4, 5, 6]
    errors = convergence(kinds, counts)
    if not reduced:
        plot_effects(payloads, bends, found).savefig(folder / "effects.png", dpi=130)
        plot_convergence(counts, errors).savefig(folder / "convergence.png", dpi=130)
    mesh = {
        str(n): float(100 * np.max(np.abs(exact(0.05, 0.0, False, n) / exact(0.05, 0.0, False) - 1)))
        for n in (2, 4, 8, 16, 24)
    }
    return {
        "payload_g": [round(1000 * p, 1) for p in payloads],
        "second_joint_deg": [round(float(np.rad2deg(b)), 1) for b in bends],
        "frequencies_hz": {
            sweep: {
                held: {what: np.round(values, 3).tolist() for what, values in pair.items()}
                for held, pair in cases.items()
            }
            for sweep, cases in found.items()
        },
        "worst_error_pct": {
            f"{sweep}, {held}": _figures(100 * np.max(np.abs(pair["modal"] / pair["exact"] - 1)))
            for sweep, cases in found.items()
            for held, pair in cases.items()
        },
        "modes_a_link": counts,
        "error_pct_by_shapes": {
            held: {kind: [_figures(v) for v in values] for kind, values in table.items()}
            for held, table in errors.items()
        },
        "finite_element_error_pct_by_elements": {n: _figures(v) for n, v in mesh.items()},
    }


def _figures(value: float) -> float:
    return float(f"{value:.3g}")
