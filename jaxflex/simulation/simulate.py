"""Simulate an arm under a controller: the one call that everything else is built on."""

from collections.abc import Sequence
from functools import partial

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import jax.tree_util as jtu
from jax.core import Tracer
from jaxtyping import Array, Float

from ..arm.arm import Arm, AssembledArm
from ..control import AbstractController, AbstractReference
from ..effects import AbstractSensorEffect
from ..kept import kept
from ..scalars import Scalar, ScalarLike, dot, optional_scalar, scalar
from ..sensors import channel_names, read_channels
from .derivatives import both_modes
from .exact import Exact, exact, require_linear, suits
from .march import march
from .methods import AbstractMethod, Adaptive, Fixed, SampleAndHold, sample
from .plant import Plant, State, derivative
from .stiffness import fastest_rate
from .trajectory import DIVERGED, INPUT_UNFIT, OK, STEP_TOO_SMALL, STEPS_EXHAUSTED, Trajectory


class InitialState(eqx.Module):
    """Where a simulation starts; what is left out is zero.

    `angles` [rad] and `rates` [rad/s] of the joints; `deflections` [m] and
    `deflection_rates` [m/s] of the modal coordinates, link by link.
    """

    angles: Float[Array, " joints"] | None = None
    rates: Float[Array, " joints"] | None = None
    deflections: Float[Array, " shapes"] | None = None
    deflection_rates: Float[Array, " shapes"] | None = None


def simulate(
    arm: Arm,
    controller: AbstractController,
    reference: AbstractReference,
    times: Float[Array, " times"],
    *,
    initial: InitialState | None = None,
    disturbance: AbstractReference | None = None,
    sample_time: ScalarLike | None = None,
    method: AbstractMethod | None = None,
    channels: Sequence[str] | None = None,
    max_steps: int = 200_000,
    adjoint: diffrax.AbstractAdjoint | None = None,
) -> Trajectory:
    """Motion of `arm` under `controller` following `reference`, at `times` [s].

    Works under `jit`, `vmap` (over any parameter of the arm, the controller or the
    reference), `grad` and `jvp`.

    **Arguments**

    - `times`: ascending, at least two; the simulation runs from the first to the last.
    - `initial`: an `InitialState`; by default at rest, all angles zero.
    - `disturbance`: torques [N m] on the joints beside the motors.
    - `sample_time` [s]: the controller computes a command this often and holds it in
      between; None for the controller's own `period`, or continuous control if it has none.
    - `method`: `Exact()`, `Adaptive(rtol, atol, solver)` or `Fixed(dt, solver)`; the latter two
      step to every jump of reference and disturbance and to every sample. By default:

      | loop, by its structure | method |
      |---|---|
      | linear, its input polynomial between jumps | `Exact()` |
      | anything else, sampled control included | `Adaptive()`, an error of 1e-6 |

      `docs/choose.md` says which others are faster where, as measured.
    - `channels`: names of those wanted; all by default. Fewer compile faster.
    - `max_steps`: after which the simulation has failed.
    - `adjoint`: one of diffrax's, to fix how the solve is differentiated; by default
      forwards through the loop and backwards with checkpoints, whichever is asked for.

    **Returns** a `Trajectory`. Under `vmap` or `jit`, a member that failed has a status
    other than zero and NaN in its channels: call `.check()` on the result.

    **Raises** `SimulationError` with the reason if the solver fails or the arm diverges
    (outside of `jit` and `vmap`); `ValueError` for times or references that do not fit.
    """
    model = arm.assemble()
    period = _period(controller, optional_scalar(sample_time))
    plant = Plant(model, controller, reference, disturbance, period)
    times = jnp.asarray(times, dtype=jnp.result_type(float))
    if times.shape[0] < 2:
        raise ValueError(f"simulate needs at least two times, found {times.shape[0]}.")
    _check_joints(plant, reference, "reference")
    if disturbance is not None:
        _check_joints(plant, disturbance, "disturbance")
    start = initial_state(plant, initial or InitialState())
    if method is None:
        method = Exact() if suits(plant, start) else Adaptive()
    elif isinstance(method, Exact):
        require_linear(plant, start)
    wanted = _wanted(plant, channels)
    inputs = (plant, start, times, method, wanted, max_steps, adjoint)
    if any(isinstance(leaf, Tracer) for leaf in jtu.tree_leaves(inputs)):
        return _integrate(*inputs)
    return _integrate_at_once(*inputs).check()


def _period(controller: AbstractController, asked: Scalar | None) -> Scalar | None:
    own = controller.period()
    if own is None or asked is None:
        return asked if own is None else own
    if not (isinstance(own, Tracer) or isinstance(asked, Tracer)) and own != asked:
        raise ValueError(
            f"sample_time = {float(asked):g} s, but the controller was made for {float(own):g} s: "
            "leave sample_time out, or make the controller for that period."
        )
    return own


def _check_joints(plant: Plant, signal: AbstractReference, what: str) -> None:
    joints = len(plant.model.joints)
    given = len(jax.eval_shape(signal, scalar(0.0)))
    if given != joints:
        raise ValueError(f"the {what} has {given} joint(s), the arm has {joints}; they must be equal.")


def _wanted(plant: Plant, channels: Sequence[str] | None) -> tuple[str, ...]:
    references = [f"reference_{i + 1}" for i in range(len(plant.model.joints))]
    known = (*channel_names(plant.model), *references)
    if channels is None:
        return known
    for name in channels:
        if name not in known:
            raise ValueError(f"channels: no {name!r} on this arm; there are {', '.join(known)}.")
    return tuple(channels)


def initial_state(plant: Plant, initial: InitialState) -> State:
    """The plant's state at the start, as scalars.

    **Raises** `ValueError` if the lengths do not fit the arm.
    """
    joints = len(plant.model.joints)
    shapes = plant.model.size - joints

    def scalars(values, count, what):
        if values is None:
            return (scalar(0.0),) * count
        if len(values) != count:
            raise ValueError(f"initial {what}: the arm has {count}, found {len(values)}.")
        return tuple(scalar(v) for v in values)

    rest = plant.rest(scalars(initial.angles, joints, "angles"))
    q = rest.q[:joints] + scalars(initial.deflections, shapes, "deflections")
    qd = scalars(initial.rates, joints, "rates") + scalars(
        initial.deflection_rates, shapes, "deflection_rates"
    )
    return plant.begun(rest._replace(q=q, qd=qd))


def has_diverged(model: AssembledArm, q: tuple) -> Array:
    """True if a link has bent by more than its length, or a coordinate is not finite."""
    _, etas = model.split(q)
    bad = ~jnp.isfinite(sum(q[1:], q[0]))
    for link, eta in zip(model.links, etas, strict=True):
        if link.shapes:
            bad = bad | ~(jnp.abs(dot(link.tip_deflection, eta)) <= link.length)
    return bad


def _jumps(plant: Plant) -> Float[Array, " jumps"]:
    signals = [s for s in (plant.reference, plant.disturbance) if s is not None]
    return jnp.concatenate([signal.jumps() for signal in signals])


def _march(inputs, adjoint: diffrax.AbstractAdjoint, max_steps: int):
    """States at the times, outcome and numbers of steps, by steps of equal length."""
    plant, start, times, method = inputs
    fastest = fastest_rate(times[0], start, plant) if method.needs_fastest() else None
    dt = method.step(fastest, times[-1] - times[0])
    backwards = not isinstance(adjoint, diffrax.ForwardMode)
    states, steps = march(plant, start, times, _jumps(plant), dt, max_steps, backwards, method.solver)
    outcome = jnp.where(steps > max_steps, STEPS_EXHAUSTED, OK)
    return states, outcome, steps, jnp.zeros_like(steps)


def _exact(inputs, adjoint: diffrax.AbstractAdjoint, max_steps: int):
    """The same of a linear loop, without steps."""
    plant, start, times, _ = inputs
    backwards = not isinstance(adjoint, diffrax.ForwardMode)
    states, pieces, fits = exact(plant, start, times, _jumps(plant), backwards)
    outcome = jnp.select([~fits, pieces > max_steps], [INPUT_UNFIT, STEPS_EXHAUSTED], OK)
    return states, outcome, pieces, jnp.zeros_like(pieces)


def _solve(inputs, adjoint: diffrax.AbstractAdjoint, max_steps: int):
    """The same by a solver of diffrax."""
    plant, start, times, method = inputs
    jumps = jax.lax.stop_gradient(_jumps(plant))
    t0 = times[0]
    solver = method.solver
    if plant.sample_time is not None:
        if isinstance(adjoint, diffrax.ForwardMode) and hasattr(solver, "scan_kind"):
            # diffrax sets this itself, but not inside a wrapper
            solver = eqx.tree_at(lambda s: s.scan_kind, solver, "lax", is_leaf=lambda x: x is None)
        solver = SampleAndHold(solver, t0)
    fastest = fastest_rate(t0, start, plant) if method.needs_fastest() else None
    solution = diffrax.diffeqsolve(
        diffrax.ODETerm(derivative),
        solver,
        t0,
        times[-1],
        method.first_step(),
        start,
        args=plant,
        saveat=diffrax.SaveAt(ts=times),
        stepsize_controller=method.controller(jumps, t0, plant.sample_time, fastest),
        adjoint=adjoint,
        event=diffrax.Event(lambda t, y, args, **_: has_diverged(args.model, y.q)),
        max_steps=max_steps,
        throw=False,
    )
    results = diffrax.RESULTS
    outcome = jnp.select(
        [solution.result == results.event_occurred, solution.result == results.max_steps_reached],
        [DIVERGED, STEPS_EXHAUSTED],
        jnp.where(solution.result == results.successful, OK, STEP_TOO_SMALL),
    )
    stats = solution.stats
    return solution.ys, outcome, stats["num_accepted_steps"], stats["num_rejected_steps"]


def _integrate(
    plant: Plant,
    start: State,
    times: Float[Array, " times"],
    method: AbstractMethod,
    wanted: tuple[str, ...],
    max_steps: int,
    adjoint: diffrax.AbstractAdjoint | None,
) -> Trajectory:
    inputs = (plant, start, times, method)
    marching = isinstance(method, Fixed) and method.marches(plant.sample_time is not None)
    way = _exact if isinstance(method, Exact) else _march if marching else _solve
    solve = partial(way, max_steps=max_steps)
    if adjoint is None:
        differentiable = both_modes(
            lambda x: solve(x, diffrax.ForwardMode()),
            lambda x: solve(x, diffrax.RecursiveCheckpointAdjoint()),
        )
        states, status, steps, rejected = differentiable(inputs)
    else:
        states, status, steps, rejected = solve(inputs, adjoint)
    lost = jax.vmap(lambda q: has_diverged(plant.model, q))(states.q).any()  # pyright: ignore
    status = jnp.where((status == OK) & lost, DIVERGED, status)
    # a failed member is blanked before the channels are read, so that nothing after its
    # failure is taken for a measurement
    states = jtu.tree_map(lambda leaf: jnp.where(status == OK, leaf, jnp.nan), states)

    def read(t: Scalar, state: State):
        state = sample(plant, times[0], t, state)
        drives = plant.drives(t, state)
        accelerated = any(name.startswith("tip_acceleration") for name in wanted)
        qdd = plant.accelerations(t, state, drives) if accelerated else None
        channels = read_channels(plant.model, state.q, state.qd, drives, qdd)
        for number, value in enumerate(plant.reference(t), 1):
            channels[f"reference_{number}"] = value
        return state, {name: channels[name] for name in wanted}

    states, channels = jax.lax.map(lambda given: read(*given), (times, states))
    for effect in plant.model.arm.effects:
        if isinstance(effect, AbstractSensorEffect) and effect.location in channels:
            channels[effect.location] = effect.read(times, channels[effect.location])
    return Trajectory(times, channels, states, status, steps, rejected)


_integrate_at_once = kept(_integrate)
