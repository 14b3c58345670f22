"""The driven link between pinned-free and clamped: what the measured frequencies say holds it."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

import jaxflex as jf

from ..foldager import (
    CLAMPED_MEASURED,
    DRIVEN_LUMPED,
    DRIVEN_MEASURED,
    YOUNGS_MODULUS_OF_THEORY,
    inferred_link,
)
from . import pictures
from .chain import far_end_chain, middle_chain
from .inference import HYPOTHESES, Boundary, CoupledLink, draws, exact, fit, measured

MODES = 6  # clamped mode shapes: the frequencies compared here have converged to 0.03 %
WITHIN = 0.07  # the agreement asked of both driven frequencies


def errors(found, given) -> np.ndarray:
    """Relative errors [%]."""
    return 100 * (np.asarray(found) / np.asarray(given) - 1)


def percentiles(values) -> list[float]:
    """The middle 95 % of `values`."""
    return [float(v) for v in np.percentile(values, [2.5, 97.5])]


def infer(link: CoupledLink, hypothesis: str) -> dict:
    """The boundary under one hypothesis, and how well it meets Table 1."""
    found = fit(link, hypothesis, measured())
    driven, clamped = link.driven(found)[:3], link.clamped(found.youngs_modulus)[:3]
    signed, deviation = exact(link, found.youngs_modulus)
    return {
        "youngs_modulus_GPa": float(found.youngs_modulus) / 1e9,
        "hub_inertia_kg_m2": float(found.hub_inertia),
        "root_stiffness_N_m": round(float(found.root_stiffness), 6),
        "driven_hz": driven.tolist(),
        "driven_error_pct": errors(driven[:2], DRIVEN_MEASURED).tolist(),
        "clamped_hz": clamped.tolist(),
        "clamped_error_pct": errors(clamped, CLAMPED_MEASURED).tolist(),
        "exact_hub_inertia_kg_m2": [float(signed[0]), float(deviation[0])],
        "exact_root_stiffness_N_m": [float(signed[1]), float(deviation[1])],
    }


def open_to_doubt(link: CoupledLink, best: dict, count: int) -> dict:
    """What reading precision, and with it the misfit of the model, leave open."""
    residuals = np.array(best["driven_error_pct"] + best["clamped_error_pct"]) / 100
    misfit = float(
        np.sqrt(np.sum(residuals**2) / (len(residuals) - 2))
    )  # two unknowns: the third is at its bound
    found = {"misfit_pct": 100 * misfit}
    for name, size in (("reading", 0.0), ("reading_and_misfit", misfit)):
        sample = draws(link, "all five", jnp.asarray(size), count)
        found[name] = {
            "hub_inertia_kg_m2": percentiles(sample.hub_inertia),
            "root_stiffness_at_most_N_m": float(np.percentile(sample.root_stiffness, 97.5)),
            "youngs_modulus_GPa": percentiles(np.asarray(sample.youngs_modulus) / 1e9),
        }
    return found


def damper(link: CoupledLink, boundary: Boundary, dampings: np.ndarray) -> tuple[np.ndarray, dict]:
    """Poles [rad/s] against the damping of the hub, and the dampings that leave Table 1 met."""
    poles = np.asarray(jax.jit(jax.vmap(lambda c: link.poles(boundary, c)))(jnp.asarray(dampings)))
    met = []
    for at in poles:
        seen = at[(at.imag > 0) & (-at.real < 0.5 * np.abs(at))].imag / (2 * np.pi)
        met.append(all(np.min(np.abs(seen / f - 1)) < WITHIN for f in DRIVEN_MEASURED))
    lowest = [at[np.argmin(np.abs(at.imag / (2 * np.pi) - DRIVEN_MEASURED[0]))] for at in poles]
    largest = int(np.argmin(met)) - 1
    return poles, {
        "largest_N_m_s": float(dampings[largest]),
        "damping_ratio_there": float(-lowest[largest].real / np.abs(lowest[largest])),
        "damping_ratio_of_back_emf": float(_back_emf_ratio(link, boundary)),
    }


def _back_emf_ratio(link, boundary):
    motor = inferred_link().joints[0].motor
    at = link.poles(boundary, motor.torque_constant * motor.back_emf_constant / motor.resistance)
    at = at[jnp.argmin(jnp.abs(at.imag / (2 * jnp.pi) - DRIVEN_MEASURED[0]))]
    return -at.real / jnp.abs(at)


def lumped(folder: Path, reduced: bool) -> dict:
    """Lumped chains against their number of masses, and the one closest to the paper's lumped model."""
    counts = np.arange(5, 13 if reduced else 41)
    chosen = np.array([5, 10] if reduced else [5, 6, 7, 8, 10, 12, 15, 20])
    inertias = np.linspace(0.0, 2e-5, 5 if reduced else 41)
    theory = jf.foldager_link().links[0]
    far = np.array([[far_end_chain(theory, int(n), j)[:3] for j in inertias] for n in counts])
    middle = np.array([middle_chain(inferred_link(model="lumped", segments=int(n)))[:3] for n in chosen])
    pictures.masses(counts, far[:, 0], chosen, middle).savefig(folder / "masses.png", dpi=130)
    worst = np.abs(errors(far, DRIVEN_LUMPED)).max(axis=-1)
    count, inertia = np.unravel_index(np.argmin(worst), worst.shape)
    return {
        "closest_number_of_masses": int(counts[count]),
        "closest_hub_inertia_kg_m2": float(inertias[inertia]),
        "closest_hz": far[count, inertia].tolist(),
        "closest_error_pct": errors(far[count, inertia], DRIVEN_LUMPED).tolist(),
        "far_end_hz": {int(n): f.tolist() for n, f in zip(counts, far[:, 0], strict=True)},
        "inferred_hz": {int(n): f.tolist() for n, f in zip(chosen, middle, strict=True)},
    }


def run(folder: Path, reduced: bool) -> dict:
    """What hub inertia and root stiffness do the driven frequencies of Table 1 imply?"""
    link = CoupledLink(MODES)
    found = {name: infer(link, name) for name in HYPOTHESES}
    best = found["all five"]
    doubt = open_to_doubt(link, best, 40 if reduced else 1000)
    modulus, inertia = jnp.asarray(1e9 * best["youngs_modulus_GPa"]), jnp.asarray(best["hub_inertia_kg_m2"])
    inferred = Boundary(modulus, inertia, jnp.asarray(0.0))

    points = 25 if reduced else 241
    inertias, stiffnesses = np.logspace(-7, 0, points), np.logspace(-2, 5, points)
    dampings = np.logspace(-4, 1, points)
    sweep = jax.jit(jax.vmap(lambda j, k: link.frequencies(Boundary(modulus, j, k))[:4]))
    against = {
        "inertia": np.asarray(sweep(inertias, np.zeros(points))),
        "stiffness, no hub": np.asarray(sweep(np.zeros(points), stiffnesses)),
        "stiffness": np.asarray(sweep(np.full(points, inertia), stiffnesses)),
    }
    poles, damped = damper(link, inferred, dampings)
    pictures.boundary(inertias, stiffnesses, dampings, against, poles, doubt["reading_and_misfit"]).savefig(
        folder / "boundary.png", dpi=130
    )
    pictures.plane(link, {"theory": found["theory"], "all five": best}).savefig(folder / "plane.png", dpi=130)

    chains = lumped(folder, reduced)

    return {
        "paper_lumped_error_pct": errors(DRIVEN_LUMPED[:2], DRIVEN_MEASURED).tolist(),
        "inferred": found,
        "open_to_doubt": doubt,
        "hub_damping": damped,
        "limits_hz": {
            "pinned_free": link.driven(Boundary(modulus, jnp.asarray(0.0), jnp.asarray(0.0)))[:3].tolist(),
            "clamped": link.clamped(modulus)[:3].tolist(),
            "pinned_free_of_theory": link.driven(
                Boundary(jnp.asarray(YOUNGS_MODULUS_OF_THEORY), jnp.asarray(0.0), jnp.asarray(0.0))
            )[:3].tolist(),
        },
        "lumped": chains,
    }
