"""The standard tuning problem: PD gains with feedforward and a free shaper, together, for one move."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxflex import Arm, Scalar, one_off, scalar

from .assess import with_payloads
from .bijections import AbstractBijection, Delays, Interval, Simplex
from .designs import Design, with_duration
from .pd import GAINS, PD
from .references import Move
from .shapers import Shaper
from .task import Limits, Outcome, Task, Weights
from .tuning import AbstractProblem


class Problem(AbstractProblem):
    """A move to be tuned: an arm, the payloads it carries, the move, and how long to watch.

    **Fields**: `arm`; `payloads` [kg] tuned on; `move` unshaped; `start`, gains with
    feedforward (a `textbook_pd(…, feedforward=True)`); `shaper_time` [s] by which the
    shaper lengthens the move (the sum of both times is kept, how they share it is tuned
    within `share_range`); `impulses` of the free shaper; `watch`, `samples`, `weights` and
    `limits` as in `Task`; and the bounds on the gains, as factors of those of `start`.
    High gains are kept out: they amplify the noise of an encoder, and make the loop stiff.
    `scenarios`, a batched arm such as `varied` gives, takes the place of `payloads` where
    more than these should vary.
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
    limits: Limits = Limits()
    scenarios: Arm | None = None

    def domains(self) -> dict[str, AbstractBijection]:
        """The domain of every parameter."""
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

    def task(self) -> Task:
        """What is asked of a design."""
        arms = with_payloads(self.arm, self.payloads) if self.scenarios is None else self.scenarios
        return Task(arms, self.watch, self.samples, self.weights, self.limits)

    def outcome(self, values: dict[str, Array]) -> Outcome:
        """Cost and constraints of the design with these parameters."""
        return self.task().outcome(self.design(values))


@one_off
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
