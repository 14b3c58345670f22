"""Is the gradient worth its price? Five methods on one tuning problem, at equal simulations and equal time."""

from pathlib import Path

import numpy as np

from . import pictures
from .methods import METHODS
from .problem import Counter, Spent, single_link, starts


def at(trace: np.ndarray, column: int, budget: float) -> float:
    """Best cost when `budget` was spent, of simulations (column 0) or seconds (1)."""
    within = trace[trace[:, column] <= budget]
    return float(within[-1, 2]) if len(within) else float(trace[0, 2])


def run(folder: Path, reduced: bool) -> dict:
    """Run every method from every start and compare what it reached."""
    simulations, seconds, repeats = (300, 0.0, 2) if reduced else (1500, 4.0, 3)
    counter = Counter(*single_link(reduced), batch=12)
    traces: dict[str, list[np.ndarray]] = {name: [] for name in METHODS}
    for seed, start in enumerate(starts(counter, repeats)):
        for name, method in METHODS.items():
            try:
                method(counter.begin(simulations, seconds), start, seed)
            except Spent:
                traces[name].append(np.array(counter.trace))
                print(f"{name}, start {seed + 1}: {counter.best:.3f} after {counter.spent} simulations")
    least = min(trace[:, 2].min() for found in traces.values() for trace in found)
    budgets = [int(b) for b in np.geomspace(simulations / 16, simulations, 5)]
    moments = [float(b) for b in np.geomspace(max(seconds, 0.5) / 16, max(seconds, 0.5), 5)]
    figures = {
        "parameters": counter.size,
        "compile_seconds": {"one start at a time": counter.compile_one, "all": counter.compile_seconds},
        "least_cost": least,
        "budgets": {"simulations": budgets, "seconds": moments},
        "methods": {},
    }
    for name, found in traces.items():
        rate = np.median([trace[-1, 0] / trace[-1, 1] for trace in found])
        figures["methods"][name] = {
            "simulations_per_second": float(rate),
            "cost_at_equal_simulations": [[at(t, 0, b) for t in found] for b in budgets],
            "cost_at_equal_seconds": [[at(t, 1, b) for t in found] for b in moments],
        }
    pictures.race(traces, simulations, max(seconds, 0.5)).savefig(folder / "optimisers.png", dpi=130)
    return figures
