"""The bang-bang response as printed, and as the unsaid assumptions could make it."""

from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .paper import COLUMNS, PAYLOADS, TABLE_II
from .pictures import plot_responses, plot_table
from .search import Found, evaluate, search
from .unknowns import CHOICES, NUMBERS, PRINTED, angles, printed

STEP = 1e-3  # s, the paper's
SEARCHED = 3  # of the choices closest to Table II, so many linear and so many nonlinear


def run(folder: Path, reduced: bool) -> dict[str, Any]:
    """Does Table II follow from what the paper prints, and if not, from which assumptions could it?"""
    payloads = (0.0, 0.1) if reduced else PAYLOADS
    choices = [PRINTED, PRINTED._replace(frozen=True, early=True)] if reduced else CHOICES
    step = 2.5e-3 if reduced else STEP
    tried = [evaluate(choice, printed(), payloads, step) for choice in choices]
    tried.sort(key=lambda found: found.misfit)
    steps, starts, coarse = (3, 1, 1e-2) if reduced else (30, 3, 2.5e-3)
    first = [
        found
        for frozen in ((True,) if reduced else (True, False))
        for found in [f for f in tried if f.choice.frozen == frozen][: 1 if reduced else SEARCHED]
    ]
    fitted = []
    for found in first:
        numbers = search(
            found.choice, (0.0, 0.1) if reduced else (0.0, 0.04, 0.1), steps, starts, coarse
        ).numbers
        fitted.append(evaluate(found.choice, numbers, payloads, step))
    fitted.sort(key=lambda found: found.misfit)
    as_printed = next(found for found in tried if found.choice == PRINTED)
    best = fitted[0]
    if not reduced:
        curves = [_curves(found, payloads) for found in (as_printed, tried[0], best)]
        titles = ["as printed", "closest choices, numbers as printed", "closest choices and numbers"]
        plot_responses(payloads, dict(zip(titles, curves, strict=True))).savefig(
            folder / "responses.png", dpi=130
        )
        tables = dict(zip(titles, (as_printed.table, tried[0].table, best.table), strict=True))
        plot_table(payloads, tables).savefig(folder / "table.png", dpi=130)
    return {
        "payload_g": [round(1000 * p, 1) for p in payloads],
        "columns": COLUMNS,
        "paper": TABLE_II,
        "as_printed": _figures(as_printed),
        "choices_with_printed_numbers": [_figures(found) for found in tried],
        "choices_with_fitted_numbers": [_figures(found) for found in fitted],
    }


def _curves(found: Found, payloads) -> np.ndarray:
    of = jax.jit(jax.vmap(lambda p: angles(found.choice, found.numbers, p, STEP)))
    return np.asarray(of(jnp.asarray(payloads)))


def _figures(found: Found) -> dict[str, Any]:
    return {
        "choice": str(found.choice),
        "misfit": _round(found.misfit),
        "numbers": {name: _round(v) for name, v in zip(NUMBERS, found.numbers, strict=True)},
        "table": [[[_round(v) for v in row] for row in joint] for joint in found.table],
        "final_angle_rad": [[_round(v) for v in joint] for joint in found.final],
    }


def _round(value) -> float | None:
    """Four figures; None where there is none, as JSON wants it."""
    return float(f"{float(value):.4g}") if np.isfinite(value) else None
