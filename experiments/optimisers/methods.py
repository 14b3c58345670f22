"""Each method runs from a start until its counter says that the budget is spent."""

import numpy as np
import scipy.optimize
from cmaes import CMA

from .problem import Counter, Method

WIDTH = 1.0  # standard deviation of the starts, and of the first population of every method that has one
BOX = 4.0  # half width of the box of differential evolution, which cannot do without one


def gradient(counter: Counter, start: np.ndarray, seed: int) -> None:
    """BFGS; where it has converged, again from a random point near its end."""
    rng, point = np.random.default_rng(seed), start
    while True:
        found = scipy.optimize.minimize(
            counter.both, point, jac=True, method="BFGS", options={"maxiter": 200}
        )
        point = found.x + WIDTH * rng.normal(size=len(start))


def nelder_mead(counter: Counter, start: np.ndarray, seed: int) -> None:
    """Nelder-Mead (adaptive), started anew from its end when it has converged."""
    rng, point = np.random.default_rng(seed), start
    while True:
        options = {"maxfev": 10**6, "maxiter": 10**6, "adaptive": True, "xatol": 1e-4, "fatol": 1e-4}
        found = scipy.optimize.minimize(counter.one, point, method="Nelder-Mead", options=options)
        point = found.x + WIDTH * rng.normal(size=len(start))


def differential_evolution(counter: Counter, start: np.ndarray, seed: int) -> None:
    """SciPy's differential evolution, each generation evaluated in one vectorised call."""
    rng = np.random.default_rng(seed)
    box = [(c - BOX, c + BOX) for c in counter.centre]
    first = np.clip(start + WIDTH * rng.normal(size=(counter.batch, len(start))), *np.transpose(box))
    first[0] = np.clip(start, *np.transpose(box))
    while True:
        scipy.optimize.differential_evolution(
            lambda x: counter.many(x.T), box, init=first, maxiter=10**6, rng=rng, polish=False,
            updating="deferred", vectorized=True, tol=0.0,
        )  # fmt: skip


def cma_es(counter: Counter, start: np.ndarray, seed: int) -> None:
    """CMA-ES of the package cmaes, each generation in one vectorised call; anew when it has converged."""
    mean = start
    while True:
        search = CMA(mean=np.array(mean), sigma=WIDTH, seed=seed, population_size=counter.batch)
        while not search.should_stop():
            points = [search.ask() for _ in range(counter.batch)]
            search.tell(list(zip(points, counter.many(np.stack(points)), strict=True)))
        mean, seed = start + np.random.default_rng(seed).normal(size=len(start)), seed + 1


def random_search(counter: Counter, start: np.ndarray, seed: int) -> None:
    """Normal points about the start, in vectorised calls."""
    rng = np.random.default_rng(seed)
    while True:
        counter.many(start + 1.5 * WIDTH * rng.normal(size=(counter.batch, len(start))))


METHODS: dict[str, Method] = {
    "gradient (BFGS)": gradient,
    "Nelder-Mead": nelder_mead,
    "differential evolution": differential_evolution,
    "CMA-ES": cma_es,
    "random search": random_search,
}
