"""The size of an effect that shows in the data as much as asked for."""

from collections.abc import Sequence

import numpy as np

from .effects import EFFECTS
from .gaps import measure
from .rigs import Rig, generator

COARSE = 10  # steps a sample while sizes are sought
ROUNDS = 9
CLOSE = 0.05  # of the gap asked for


class Search:
    """The root of a rising function of a logarithm: a bracket, found by steps and closed by secants."""

    def __init__(self, first: float, top: float):
        self.at, self.top = min(first, top), top
        self.below: tuple[float, float] | None = None  # largest place known too small, and its miss
        self.above: tuple[float, float] | None = None
        self.best = (np.inf, self.at)

    def tell(self, miss: float) -> bool:
        """Take in how far the function is from its aim at `at`, and move on; true when done."""
        self.best = min(self.best, (abs(miss), self.at))
        if abs(miss) < CLOSE or (miss < 0 and self.at >= self.top):
            return True
        if miss < 0:
            self.below = (self.at, miss)
        else:
            self.above = (self.at, miss)
        if self.below and self.above:
            (low, under), (high, over) = self.below, self.above
            share = -under / (over - under) if np.isfinite(over) else 0.5
            self.at = low + np.clip(share, 0.1, 0.9) * (high - low)
        else:
            self.at = min(self.at + np.clip(-miss, -2.0, 2.0), self.top)
        return False


def hide(rig: Rig, key: object, name: str, size: float):
    """Write the effect into the rig; its secondary choices depend on the key alone."""
    draw, joints = generator("effect", key, name), rig.nominal.joints
    return EFFECTS[name].hide(rig, size, int(draw.integers(joints)) if joints > 1 else 0, draw)


def find_sizes(tasks: Sequence[tuple[Rig, object, str, float]]) -> list[float]:
    """The size of each effect (rig, key, name, gap) that gives the projected gap asked for.

    Where no size up to the largest believable one does, that one.
    """
    searches = [
        Search(np.log(EFFECTS[name].guess * gap / 3), np.log(EFFECTS[name].most)) for *_, name, gap in tasks
    ]
    left = list(range(len(tasks)))
    for _ in range(ROUNDS):
        rigs = []
        for t in left:
            rig, key, name, _ = tasks[t]
            rigs.append(rig.copy())
            hide(rigs[-1], key, name, float(np.exp(searches[t].at)))
        if rigs:
            measured, _, _ = measure([tasks[t][0] for t in left], rigs, COARSE)
            sizes = np.log([max(m.size, 1e-6) for m in measured])
            left = [
                t for t, s in zip(left, sizes, strict=True) if not searches[t].tell(s - np.log(tasks[t][-1]))
            ]
    return [float(np.exp(s.best[1])) for s in searches]
