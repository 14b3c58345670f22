"""Tune PD gains and a free shaper by gradient through the simulation, over payloads.

The cost looks at the tip from the end of the commanded move on: its excursion about the
target, by payload, in a smooth maximum (so that no payload is sacrificed) and in the
mean. Logarithms make both free of scale. Effort and peak voltage enter as penalties;
move time is kept by construction, since the delays of the shaper end where they must.
"""

from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Float

from jaxflex import (
    Arm,
    Fixed,
    Scalar,
    adjoint_for,
    residual_vibration,
    scalar,
    tip_position,
)

from .assess import run, with_payloads
from .bijections import AbstractBijection, Delays, Interval, Simplex
from .designs import Design, with_duration
from .minimise import Minimum, make_stepper, minimise
from .pd import GAINS, PD
from .references import Move
from .shapers import Shaper


class Weights(eqx.Module):
    """What the cost is made of.

    **Fields** (dimensionless)

    - `worst`: share of the smooth maximum over payloads, the rest goes to their mean
    - `sharpness`: exponent of the smooth maximum; higher looks at the worst alone
    - `settling`: weight of the logarithm of the tip's rms distance from the target
      after the move, which tells a short excursion from one that goes on
    - `effort`: weight of the mean square voltage as a share of the limit
    - `voltage`: share of the voltage limit above which a penalty sets in
    - `deflection`: share of a link's length above which its tip deflection is penalised:
      beyond a tenth the small-deflection model no longer holds, and a search that may
      leave it would
    - `barrier`: weight of both penalties, on the square of the relative excess
    """

    worst: float = 0.8
    sharpness: float = 8.0
    settling: float = 0.2
    effort: float = 0.05
    voltage: float = 0.9
    deflection: float = 0.1
    barrier: float = 300.0


class Problem(eqx.Module):
    """A move to be tuned: an arm, the payloads it carries, the move, and how long to watch.

    **Fields**: `arm`; `payloads` [kg] tuned on; `move` unshaped; `shaper_time` [s] by
    which the shaper lengthens it (the sum of both times is kept, how they share it is
    tuned within `share_range`); `impulses` of the free shaper; `watch` [s] after the
    commanded move; `samples` of the cost in each half; `weights`; and the bounds on the gains, as factors of those of
    `start`, which has feedforward (a `textbook_pd(…, feedforward=True)`). High gains are
    kept out: they amplify the noise of an encoder, and make the loop stiff.
    """

    arm: Arm
    payloads: Float[Array, " payloads"]
    move: Move
    start: PD
    shaper_time: Scalar = eqx.field(converter=scalar)
    watch: Scalar = eqx.field(converter=scalar, default=2.0)
    impulses: int = eqx.field(static=True, default=5)
    share_range: tuple[float, float] = eqx.field(static=True, default=(0.05, 0.8))
    samples: int = eqx.field(static=True, default=121)
    stiffness_range: tuple[float, float] = eqx.field(static=True, default=(0.1, 5.0))
    damping_range: tuple[float, float] = eqx.field(static=True, default=(0.3, 6.0))
    feedforward_range: tuple[float, float] = eqx.field(static=True, default=(0.25, 4.0))
    weights: Weights = Weights()

    def domains(self) -> dict[str, AbstractBijection]:
        """The domain of every parameter, in the order in which the minimiser sees them."""
        ranges = (self.stiffness_range, self.damping_range) + 2 * (self.feedforward_range,)
        domains: dict[str, AbstractBijection] = {}
        for name, (low, high) in zip(GAINS, ranges, strict=True):
            # a gain of zero is given some room all the same
            floor = 1e-3 * jnp.stack(self.start.stiffness)
            size = jnp.maximum(jnp.stack(getattr(self.start, name)), floor)
            domains[name] = Interval(low * size, high * size)
        low, high = self.share_range
        return domains | {
            "amplitudes": Simplex(),
            "delays": Delays(1.0),
            "share": Interval(jnp.full(1, low), jnp.full(1, high)),
        }

    def values(self, free: Float[Array, " free"]) -> dict[str, Array]:
        """Parameters from the one unconstrained vector that the minimiser moves."""
        domains, joints = self.domains(), len(self.start.stiffness)
        sizes = {"amplitudes": self.impulses - 1, "delays": self.impulses - 2, "share": 1}
        cuts = np.cumsum([sizes.get(name, joints) for name in domains])[:-1]
        parts = jnp.split(free, cuts)
        return {k: d.value(p) for (k, d), p in zip(domains.items(), parts, strict=True)}

    def free(self, values: dict[str, Array]) -> Float[Array, " free"]:
        """The unconstrained vector that stands for these parameters."""
        return jnp.concatenate([d.free(values[k]) for k, d in self.domains().items()])

    def design(self, values: dict[str, Array]) -> Design:
        """The design with these parameters."""
        gains = [tuple(values[name]) for name in GAINS]
        share = values["share"][0]
        move = with_duration(self.move, (1 - share) * self.total_time())
        shaper = Shaper(values["amplitudes"], share * self.total_time() * values["delays"])
        return Design(PD(*gains), move, shaper)

    def total_time(self) -> Scalar:
        """Time [s] of the commanded move, shaper included."""
        return self.move.end() + self.shaper_time


def beyond(signal: Float[Array, " times"], limit: float) -> Scalar:
    """Square of the relative excess of the signal's peak over `limit`; zero within it."""
    return jnp.maximum(jnp.max(jnp.abs(signal)) / limit - 1, 0.0) ** 2


def cost(problem: Problem, values: dict[str, Array]) -> Scalar:
    """The cost of a design; infinite where a simulation fails."""
    design = problem.design(values)
    weights, move = problem.weights, problem.move
    end = problem.total_time()
    during = jnp.linspace(0.0, 1.0, problem.samples)[:-1] * end
    after = end + jnp.linspace(0.0, 1.0, problem.samples) * problem.watch
    times = jnp.concatenate([during, after])
    target = tip_position(problem.arm, jnp.stack(move.stop))
    travel = jnp.linalg.norm(target - tip_position(problem.arm, jnp.stack(move.start)))

    motors = [i for i, joint in enumerate(problem.arm.joints, 1) if joint.motor is not None]
    bending = [i for i, link in enumerate(problem.arm.links, 1) if link.modes]
    wanted = ["tip_x", "tip_y", *(f"voltage_{i}" for i in motors)]
    wanted += [f"tip_deflection_{i}" for i in bending]

    def one(arm):
        trajectory = run(
            design,
            arm,
            times,
            method=Fixed(),  # stability, not accuracy, sets the step here
            channels=wanted,
            max_steps=50_000,
            adjoint=adjoint_for(sum(value.size for value in values.values())),
        )
        late = trajectory.tip[problem.samples - 1 :]
        excursion = residual_vibration(after, late, end, target)
        distance = jnp.sqrt(jnp.mean(jnp.sum((late - target) ** 2, axis=1)))
        effort, excess = jnp.zeros(()), jnp.zeros(())
        for i in motors:
            limit = arm.joints[i - 1].motor.voltage_limit
            if limit is not None:
                share = trajectory[f"voltage_{i}"] / limit
                effort = effort + jnp.mean(share**2)
                excess = excess + beyond(share, weights.voltage)
        for i in bending:
            share = trajectory[f"tip_deflection_{i}"] / arm.links[i - 1].length
            excess = excess + beyond(share, weights.deflection)
        ok = trajectory.status == 0
        # a failed member counts as infinite, and its NaN must not reach the gradient
        return (
            jnp.where(ok, excursion / travel, jnp.inf),
            jnp.where(ok, distance / travel, jnp.inf),
            effort,
            excess,
        )

    excursion, distance, effort, excess = jax.vmap(one)(with_payloads(problem.arm, problem.payloads))
    p = weights.sharpness
    logs = jnp.log(excursion)
    worst = jax.nn.logsumexp(p * logs) / p - jnp.log(logs.shape[0]) / p
    return (
        weights.worst * worst
        + (1 - weights.worst) * jnp.mean(logs)
        + weights.settling * jnp.mean(jnp.log(distance))
        + weights.effort * jnp.mean(effort)
        + weights.barrier * jnp.mean(excess)
    )


class Tuned(NamedTuple):
    """The outcome of `tune`: the best `design`, its `values`, and every start's `minimum`."""

    design: Design
    values: dict[str, Array]
    cost: float
    minima: list[Minimum]


def random_starts(
    problem: Problem, first: dict[str, Array], count: int, seed: int
) -> list[Float[Array, " free"]]:
    """`count` points to start from: `first`, and others scattered about it (normal, one unit wide)."""
    centre = problem.free(first)
    scatter = jax.random.normal(jax.random.key(seed), (count - 1, centre.shape[0]), centre.dtype)
    return [centre, *(centre + row for row in scatter)]


def tune(
    problem: Problem,
    first: dict[str, Array],
    starts: int = 8,
    descents: int = 2,
    max_steps: int = 60,
    seconds: float | None = None,
    seed: int = 0,
    minimiser: optx.AbstractMinimiser | None = None,
    progress: Callable[[str, int, float], None] | None = None,
) -> Tuned:
    """Gains and shaper of least `cost`, from several starts.

    `starts` points are tried, the `descents` best of them followed down by `minimiser`
    (BFGS unless told), each for at most `max_steps` evaluations and an equal share of
    `seconds`. `progress(what, step, cost)` is called on the way.

    **Raises** `RuntimeError` if no start can be simulated.
    """

    def of_free(free):
        return cost(problem, problem.values(free))

    points = random_starts(problem, first, starts, seed)
    stepper = make_stepper(of_free, minimiser or optx.BFGS(rtol=1e-4, atol=1e-4), points[0])
    ranked = []
    for number, point in enumerate(points, 1):
        # the first step only evaluates, and needs no program of its own
        ranked.append((minimise(stepper, point, 1).cost, number, point))
        if progress is not None:
            progress("starts", number, min(r[0] for r in ranked))
    ranked.sort(key=lambda r: r[:2])
    if not np.isfinite(ranked[0][0]):
        raise RuntimeError(
            "no start of the tuning could be simulated: the loop is unstable or too stiff with all "
            "of them; begin from other gains or a slower move."
        )
    minima = []
    for number, (_, _, point) in enumerate(ranked[:descents], 1):

        def report(step, value, number=number):
            if progress is not None:
                progress(f"descent {number}", step, value)

        share = None if seconds is None else seconds / descents
        minima.append(minimise(stepper, point, max_steps, share, report))
    best = min(minima, key=lambda m: m.cost)
    values = problem.values(best.free)
    return Tuned(problem.design(values), values, best.cost, minima)


def standard_start(problem: Problem) -> dict[str, Array]:
    """Gains in the middle of their range, and a shaper of equal gaps with binomial amplitudes."""
    n = problem.impulses
    weights = np.array([float(np.prod([(n - 1 - j) / (j + 1) for j in range(k)])) for k in range(n)])
    middle = {
        name: jnp.sqrt(domain.low * domain.high)
        for name, domain in problem.domains().items()
        if isinstance(domain, Interval) and name in GAINS
    }
    return middle | {
        "amplitudes": jnp.asarray(weights / weights.sum()),
        "delays": jnp.linspace(0.0, 1.0, n),
        "share": (problem.shaper_time / problem.total_time())[None],
    }
