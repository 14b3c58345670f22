"""The bang-bang response as printed, and as the unsaid assumptions could make it."""

from pathlib import Path
from typing import Any

import numpy as np

from .paper import COLUMNS, PAYLOADS, TABLE_II
from .pictures import plot_responses, plot_table
from .search import Found, evaluate, search
from .unknowns import CHOICES, NUMBERS, PRINTED, printed

STEP = 1e-3  # s, the paper's


def run(folder: Path, reduced: bool) -> dict[str, Any]:
    """Does Table II follow from what the paper prints, and if not, from which assumptions could it?"""
    payloads = (0.0, 0.1) if reduced else PAYLOADS
    choices = [PRINTED, PRINTED._replace(frozen=True)] if reduced else CHOICES
    step, coarse = 2.5e-3 if reduced else STEP, 2.5e-3
    tried = _ranked([found for choice in choices for found in evaluate(choice, printed(), payloads, step)])
    steps, starts = (8, 1) if reduced else (25, 3)
    fitted = []
    for frozen in (True,) if reduced else (True, False):
        choice = next(found.choice for found in tried if found.choice.frozen == frozen)
        numbers = search(choice, (0.0, 0.1), steps, starts, coarse)
        fitted += [found for found in evaluate(choice, numbers, payloads, step) if found.choice == choice]
    fitted = _ranked(fitted)
    as_printed = next(found for found in tried if found.choice == PRINTED)
    best = fitted[0]
    if not reduced:
        curves = [found.curves for found in (as_printed, tried[0], best)]
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


def _ranked(cases: list[Found]) -> list[Found]:
    return sorted(cases, key=lambda found: found.misfit)


def _figures(found: Found) -> dict[str, Any]:
    return {
        "choice": str(found.choice),
        "misfit": _round(found.misfit),
        "numbers": {name: _round(v) for name, v in zip(NUMBERS, found.numbers, strict=True)},
        "table": [[[_round(v) for v in row] for row in joint] for joint in found.table],
        "final_angle_rad": [[_round(v) for v in joint] for joint in found.curves[..., -1].T],
    }


def _round(value) -> float | None:
    """Four figures; None where there is none, as JSON wants it."""
    return float(f"{float(value):.4g}") if np.isfinite(value) else None
