"""How a simulation steps: adaptive, fixed step, and the sample-and-hold that wraps either."""

# diffrax hands its solvers and controllers scalars that it types more loosely than they are
# pyright: reportArgumentType=false, reportCallIssue=false

from abc import abstractmethod

import diffrax
import equinox as eqx
import equinox.internal as eqxi
import jax.numpy as jnp
import jax.tree_util as jtu
from jaxtyping import Array, Bool, Float

from ..scalars import Scalar, optional_scalar
from .plant import Plant, State
from .rosenbrock import LinearlyImplicit
from .runge_kutta import RungeKutta4

SMALLEST_STEP = 1e-10  # s; an adaptive solve that asks for less has failed
INSTANT_SLACK = 1e-6  # share of a period within which two instants count as one


class AbstractMethod(eqx.Module):
    """How a simulation gets from its start to its end."""


class AbstractSteps(AbstractMethod):
    """A solver and how it chooses its steps."""

    solver: eqx.AbstractVar[diffrax.AbstractSolver]

    @abstractmethod
    def controller(
        self, jumps: Float[Array, " jumps"], start: Scalar, period: Scalar | None, fastest: Scalar | None
    ) -> diffrax.AbstractStepSizeController:
        """Step-size control that steps to all of `jumps` [s], and to every `period` [s] from `start`.

        `fastest` [rad/s] is the fastest rate of the loop, where `needs_fastest` asks for it.
        """

    @abstractmethod
    def needs_fastest(self) -> bool:
        """True if the fastest rate of the loop should be estimated before the run."""

    @abstractmethod
    def first_step(self) -> Scalar | None:
        """Size of the first step [s], or None to let the solver choose."""


class Adaptive(AbstractSteps):
    """Steps chosen for an error of `rtol` relative and `atol` absolute in every state.

    The default solver, `diffrax.Tsit5`, suits arms whose fastest mode matters; give
    `diffrax.Kvaerno5()` for stiff ones (many modes, stiff joints, small inductance).

    No step of an explicit solver is longer than `stability` over the fastest rate of the
    loop at the start. An arm at rest makes no error whatever the step, and steps would
    grow past the limit of stability unseen, but not unfelt by derivatives. Where the arm
    moves all the time, None does without the estimate and steps are up to twice as long.
    """

    rtol: float = eqx.field(static=True, default=1e-6)
    atol: float = eqx.field(static=True, default=1e-8)
    solver: diffrax.AbstractSolver = diffrax.Tsit5()
    stability: float | None = eqx.field(static=True, default=1.7)

    def needs_fastest(self) -> bool:
        """True for an explicit solver, unless `stability` is None."""
        implicit = isinstance(self.solver, diffrax.AbstractImplicitSolver)
        return self.stability is not None and not implicit

    def controller(
        self, jumps: Float[Array, " jumps"], start: Scalar, period: Scalar | None, fastest: Scalar | None
    ) -> diffrax.AbstractStepSizeController:
        """A PI controller clipped to the jumps and the sample instants."""
        longest = None
        if fastest is not None and self.stability is not None:
            some = fastest > 0
            longest = jnp.where(some, self.stability / jnp.where(some, fastest, 1.0), jnp.inf)
        pid = diffrax.PIDController(
            rtol=self.rtol, atol=self.atol, pcoeff=0.2, icoeff=0.5, dtmin=SMALLEST_STEP, dtmax=longest
        )
        # diffrax looks into the jumps, so there must be some
        clipped = diffrax.ClipStepSizeController(pid, jump_ts=jumps) if jumps.shape[0] else pid
        if period is None:
            return clipped
        return _ClipToSamples(inner=clipped, start=start, period=period)

    def first_step(self) -> Scalar | None:
        """Chosen by the solver."""
        return None


class Fixed(AbstractSteps):
    """Steps of at most `dt` [s] that land on every jump and sample instant.

    With the classical Runge-Kutta method, the default, and continuous control, steps
    between two instants are of equal length and run in a loop of their own (`march`),
    many times faster for a batch than any other method here, and so does
    `LinearlyImplicit()`, for longer steps. Any other explicit solver of
    diffrax will do, on a grid of `dt` cut short at each instant.

    `dt=None` takes `stability` over the fastest rate of the loop at the start: right where
    the fastest mode limits the step and accuracy does not. The classical method is stable
    up to 2.78; the rest is for poses in which the arm is faster than at the start.
    """

    dt: Scalar | None = eqx.field(converter=optional_scalar, default=None)
    solver: diffrax.AbstractSolver | LinearlyImplicit = RungeKutta4()
    stability: float = eqx.field(static=True, default=2.0)

    def needs_fastest(self) -> bool:
        """True if no step is given."""
        return self.dt is None

    def marches(self, sampled: bool) -> bool:
        """True if `march` serves: the classical or the linearly implicit method, and no sampled control."""
        if isinstance(self.solver, LinearlyImplicit) and (sampled or self.dt is None):
            raise ValueError("Fixed(dt, LinearlyImplicit()) needs a step dt and continuous control.")
        return type(self.solver) in (RungeKutta4, LinearlyImplicit) and not sampled

    def step(self, fastest: Scalar | None, span: Scalar) -> Scalar:
        """The longest step [s]: `dt`, or what `fastest` [rad/s] allows, but a hundredth of `span` [s]."""
        if self.dt is not None:
            return self.dt
        assert fastest is not None
        return jnp.minimum(self.stability / jnp.maximum(fastest, 1e-300), span / 100)

    def controller(
        self, jumps: Float[Array, " jumps"], start: Scalar, period: Scalar | None, fastest: Scalar | None
    ) -> diffrax.AbstractStepSizeController:
        """A grid of `dt` that also holds the jumps and the sample instants."""
        return _GridSteps(jnp.sort(jumps), start, period)

    def first_step(self) -> Scalar | None:
        """`dt` [s]."""
        if self.dt is None:
            raise ValueError(
                "Fixed(dt=None) needs the classical method and continuous control; give it a step."
            )
        return self.dt


def next_instant(t: Scalar, start: Scalar, period: Scalar) -> Scalar:
    """The first of `start + k period` after `t`, a hair of slack keeping it from being `t` itself."""
    return start + (jnp.floor((t - start) / period + INSTANT_SLACK) + 1) * period


def at_instant(t: Scalar, start: Scalar, period: Scalar) -> Bool[Array, ""]:
    """True where `t` is one of `start + k period`, to rounding."""
    periods = (t - start) / period
    return jnp.abs(periods - jnp.round(periods)) < INSTANT_SLACK


class _GridSteps(diffrax.AbstractStepSizeController):
    """Steps to the next point of a uniform grid, to just before a jump, or to a sample instant."""

    jumps: Float[Array, " jumps"]
    start: Scalar
    period: Scalar | None

    def wrap(self, direction):
        return self

    def init(self, terms, t0, t1, y0, dt0, args, func, error_order):
        del terms, t1, y0, args, func, error_order
        return self._next(t0, dt0), dt0

    def _next(self, t, dt):
        ahead = jnp.where(self.jumps > t + INSTANT_SLACK * dt, self.jumps, jnp.inf)
        jump = jnp.min(ahead, initial=jnp.inf)
        t1 = jnp.minimum(next_instant(t, self.start, dt), eqxi.prevbefore(jump))
        return t1 if self.period is None else jnp.minimum(t1, next_instant(t, self.start, self.period))

    def adapt_step_size(self, t0, t1, y0, y1_candidate, args, y_error, error_order, controller_state):
        del t0, y0, y1_candidate, args, y_error, error_order
        after = eqxi.nextafter(t1)
        jumped = jnp.any(after == self.jumps)
        t0 = jnp.where(jumped, eqxi.nextafter(after), t1)
        if self.period is not None:
            jumped = jumped | at_instant(t0, self.start, self.period)
        result = diffrax.RESULTS.successful
        return True, t0, self._next(t0, controller_state), jumped, controller_state, result


class _ClipToSamples(diffrax.AbstractAdaptiveStepSizeController):
    """Another step-size controller, clipped to land on every sample instant."""

    inner: diffrax.AbstractAdaptiveStepSizeController
    start: Scalar
    period: Scalar

    @property
    def rtol(self):
        return self.inner.rtol

    @property
    def atol(self):
        return self.inner.atol

    @property
    def norm(self):  # pyright: ignore
        return self.inner.norm

    def wrap(self, direction):
        return _ClipToSamples(self.inner.wrap(direction), self.start, self.period)  # pyright: ignore

    def init(self, terms, t0, t1, y0, dt0, args, func, error_order):
        t1, state = self.inner.init(terms, t0, t1, y0, dt0, args, func, error_order)
        return jnp.minimum(t1, next_instant(t0, self.start, self.period)), state

    def adapt_step_size(self, t0, t1, y0, y1_candidate, args, y_error, error_order, controller_state):
        keep, t0, t1, jumped, state, result = self.inner.adapt_step_size(
            t0, t1, y0, y1_candidate, args, y_error, error_order, controller_state
        )
        t1 = jnp.minimum(t1, next_instant(t0, self.start, self.period))
        return keep, t0, t1, jumped | at_instant(t0, self.start, self.period), state, result


class SampleAndHold(diffrax.AbstractWrappedSolver):
    """A solver that samples the controller at the start of every period and holds its command.

    A step that begins at a sample instant first replaces the held command; the step-size
    controller makes sure that steps do begin there.
    """

    solver: diffrax.AbstractSolver
    start: Scalar

    @property
    def term_structure(self):
        return self.solver.term_structure

    @property
    def scan_kind(self):
        return getattr(self.solver, "scan_kind", None)

    @property
    def interpolation_cls(self):  # pyright: ignore
        return self.solver.interpolation_cls

    @property
    def term_compatible_contr_kwargs(self):
        return self.solver.term_compatible_contr_kwargs

    def order(self, terms):
        return self.solver.order(terms)

    def error_order(self, terms):
        return self.solver.error_order(terms)

    def init(self, terms, t0, t1, y0, args):
        return self.solver.init(terms, t0, t1, y0, args)

    def step(self, terms, t0, t1, y0, args, solver_state, made_jump):
        y0 = sample(args, self.start, t0, y0)
        return self.solver.step(terms, t0, t1, y0, args, solver_state, made_jump)

    def func(self, terms, t0, y0, args):
        return self.solver.func(terms, t0, y0, args)


def sample(plant: Plant, start: Scalar, t: Scalar, state: State) -> State:
    """`state` with its command held anew if `t` is a sample instant; as it is under continuous control."""
    if plant.sample_time is None:
        return state
    fresh = at_instant(t, start, plant.sample_time)
    after = plant.sampled(t, state)
    return jtu.tree_map(lambda a, b: jnp.where(fresh, a, b), after, state)
