"""Where the model goes wrong: the force that would have to act for it to be right.

A force held over a few samples is added to one equation at a time and estimated by least
squares, its size set by the evidence. The equation whose force explains most is where
something is missing, and the force drawn over speed, angle or time shows what.
"""

# arrays of numpy go to JAX and come back, which its annotations do not foresee
# pyright: reportArgumentType=false, reportOptionalMemberAccess=false

import itertools
from dataclasses import dataclass

import numpy as np

from .catalogue import Motion, index
from .chains import LOST, Linearised
from .normal import solve
from .runs import Run
from .shooting import Problem

PERIODS = 5  # that a disturbance must go through to be told from the motion
BLOCKS = 10  # values of the force in a piece
FASTEST = 1e6  # rad/s: beyond it a motion is lost


@dataclass(frozen=True)
class LatentForce:
    """An estimated force: `values` at `times` [s], the `equation` it acts in, what it explains.

    `evidence`: fall of twice the negative log marginal likelihood against no force.
    """

    equation: str
    unit: str
    times: np.ndarray
    values: np.ndarray
    evidence: float
    angle: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray


def equations(problem: Problem) -> list[tuple[str, str, int]]:
    """Name, unit and column of forcing of every equation a force can be added to."""
    arm = problem.setting.parameters.arm
    joints = len(arm.joints)
    found = [(f"joint_{i + 1}", "N m", joints + i) for i in range(joints)]
    if arm.drive == "voltage":
        found += [(f"voltage_{i + 1}", "V", i) for i in range(joints)]
    place = 2 * joints
    for i, link in enumerate(arm.assemble().links):
        if link.shapes > link.loose:
            found.append((f"link_{i + 1}", "N", place))
        place += link.shapes
    return found


def latent_forces(problem: Problem, run: Run, vector: np.ndarray, horizon: int) -> list[LatentForce]:
    """The force in every equation that would make the model fit, the likeliest first.

    None where the motion is lost.
    """
    s = problem.setting
    places = equations(problem)
    joints = run.command.shape[1]
    size = s.parameters.arm.assemble().size
    edges = np.linspace(0, s.length, min(BLOCKS, s.length) + 1).round().astype(int)
    blocks = len(edges) - 1
    forcing = np.zeros((len(places) * blocks, run.pieces, s.length, joints + size))
    for e, (_, _, column) in enumerate(places):
        for b in range(blocks):
            forcing[e * blocks + b, :, edges[b] : edges[b + 1], column] = 1.0
    linear = problem.linearise(run, vector, [], forcing)
    motion = Motion(problem, run, vector)
    found = []
    for e, (name, unit, _) in enumerate(places):
        part = slice(e * blocks, (e + 1) * blocks)
        values, evidence = _estimate(problem, run, linear, part, horizon)
        joint = min(index(name), joints - 1)
        middle = [(a + b) // 2 for a, b in itertools.pairwise(edges)]
        angle = motion.angle(joint).mean(0)[:, middle].ravel()
        rate = motion.rate(joint).mean(0)[:, middle].ravel()
        times = motion.time[:, middle].ravel()
        values = values.ravel()
        followed = np.isfinite(rate) & (np.abs(rate) < FASTEST) & np.isfinite(angle) & np.isfinite(values)
        values, angle, rate = (np.where(followed, part, 0.0) for part in (values, angle, rate))
        acceleration = np.gradient(rate, times)
        inside = times <= run.times[-1]
        found.append(
            LatentForce(
                name, unit, times[inside], values[inside], evidence,
                angle[inside], rate[inside], acceleration[inside],
            )
        )  # fmt: skip
    return sorted(found, key=lambda force: -force.evidence)


def _estimate(
    problem: Problem, run: Run, linear: Linearised, part: slice, horizon: int
) -> tuple[np.ndarray, float]:
    """Values of one force in every block of every piece, and their evidence."""
    states, blocks = run.starts.shape[1], part.stop - part.start
    cuts = list(range(0, run.pieces, horizon))
    systems = []
    for first in cuts:
        last = min(first + horizon, run.pieces)
        count = (last - first) * blocks
        by_start, by_force, offset = np.eye(states), np.zeros((states, count)), np.zeros(states)
        rows = []
        for j in range(first, last):
            own = slice((j - first) * blocks, (j - first + 1) * blocks)
            slope = linear.by_start[j]
            here = slope @ by_force
            here[..., own] += linear.by_column[j][..., part]
            rows.append(
                np.concatenate([slope @ by_start, here, (linear.residual[j] - slope @ offset)[..., None]], -1)
            )
            through = linear.end_by_start[j]
            by_force = through @ by_force
            by_force[:, own] += linear.end_by_column[j][:, part]
            by_start, offset = through @ by_start, through @ offset + linear.gap[j]
        table = np.concatenate(rows).reshape(-1, states + count + 1)
        with np.errstate(all="ignore"):
            gram = table.T @ table
        a = slice(0, states)
        inner = gram[a, a] + np.diag(1 / problem.setting.start_spread**2)
        gram = gram[states:, states:] - gram[states:, a] @ solve(inner, gram[a, states:])
        if not np.isfinite(gram).all() or np.abs(gram).max() > LOST:
            gram = np.zeros_like(gram)  # nothing can be said of a motion that left all bounds
        systems.append(gram)
    # the prior's standard deviation by evidence, on a grid of half decades
    sizes = [np.median(np.diag(g)[:-1]) for g in systems if g.any()]
    if not sizes:
        return np.zeros((run.pieces, blocks)), 0.0
    typical = np.median(sizes)
    spectra = [(*np.linalg.eigh(g[:-1, :-1]), g[:-1, -1]) for g in systems]
    best = (0.0, 0.0)
    for spread in np.logspace(-2, 4, 13) / np.sqrt(max(typical, 1e-300)):
        gain = 0.0
        for values, vectors, right in spectra:
            seen = 1 + np.clip(values, 0, None) * spread**2
            gain += float((spread**2 / seen) @ (vectors.T @ right) ** 2) - float(np.log(seen).sum())
        best = max(best, (gain, spread))
    gain, spread = best
    estimates = []
    for values, vectors, right in spectra:
        share = spread**2 / (1 + np.clip(values, 0, None) * spread**2)
        estimates.append((vectors @ (share * (vectors.T @ right))).reshape(-1, blocks))
    return np.concatenate(estimates), gain


def regimes(force: LatentForce) -> list[tuple[str, float]]:
    """What the force goes with: share of its energy that each simple picture explains, largest first."""
    v, x, a, f = force.rate, force.angle, force.acceleration, force.values
    scale = max(float(np.sqrt(np.mean(v**2))), 1e-12)
    sign = np.tanh(v / (0.02 * scale))
    t = force.times / max(force.times[-1], 1e-12)
    pictures = {
        "a constant": [np.ones_like(v)],
        "the direction of motion (speed reversals)": [sign],
        "low speed": [sign * np.exp(-((v / (0.15 * scale)) ** 2))],
        "motion either way": [sign**2],
        "speed": [v],
        "high speed (its square)": [v * np.abs(v)],
        "the angle": [x],
        "the sine and cosine of the angle": [np.sin(x), np.cos(x)],
        "acceleration": [a],
        "the square of speed times the angle's side": [v**2],
        "time since the start": [t],
    }
    total = float(f @ f)
    found = []
    for name, columns in pictures.items():
        basis = np.stack(columns, 1)
        fitted = basis @ np.linalg.lstsq(basis, f, rcond=None)[0]
        found.append((name, 1 - float(np.sum((f - fitted) ** 2)) / total if total > 0 else 0.0))
    return sorted(found, key=lambda item: -item[1])


def strongest_frequencies(force: LatentForce, count: int) -> list[float]:
    """Frequencies [Hz] of the largest lines of the force, from a finely sampled periodogram."""
    step = float(np.median(np.diff(force.times)))
    span = force.times[-1] - force.times[0]
    values = (force.values - force.values.mean()) * np.hanning(len(force.values))
    top = min(0.4 / step, 50.0)
    grid = np.arange(PERIODS / span, top, 0.1 / span)
    power = np.abs(np.exp(-2j * np.pi * np.outer(grid, force.times)) @ values) ** 2
    found: list[float] = []
    for k in np.argsort(-power):
        if all(abs(grid[k] - f) > 1.5 / span for f in found):
            found.append(float(grid[k]))
        if len(found) == count:
            break
    return found
