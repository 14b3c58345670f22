"""The closed loop made linear about a resting place, and its modes."""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax.core import Tracer
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Complex, Float, Int

from ..arm.arm import Arm, AssembledArm
from ..control import AbstractController, AbstractReference, Setpoint
from ..one_off import one_off
from ..scalars import Scalar, scalar
from ..sensors import channel_names, read_channels
from ..simulation.plant import Plant, State, derivative


class _Setpoint(AbstractReference):
    """A reference that is one given setpoint at all times."""

    given: Setpoint

    def __call__(self, t: Scalar) -> tuple[Scalar, ...]:
        return self.given.value

    def jumps(self) -> Float[Array, " jumps"]:
        return jnp.zeros(0)

    def end(self) -> Scalar:
        return scalar(0.0)

    def setpoint(self, t: Scalar) -> Setpoint:
        return self.given


def resting_reference(setpoint: Setpoint) -> AbstractReference:
    """The reference that is `setpoint` at all times."""
    return _Setpoint(setpoint)


class LinearModel(NamedTuple):
    """`x' = A x + B u`, `y = C x + D u` about a resting place.

    State x: coordinates, rates, currents, controller memory, in the order of `State`.
    Input u: of an open loop the commands; of a closed loop the reference's angle of
    every joint, then its rate, then its acceleration. Output y: `channels`, in order.
    """

    A: Float[Array, "states states"]
    B: Float[Array, "states inputs"]
    C: Float[Array, "outputs states"]
    D: Float[Array, "outputs inputs"]
    channels: tuple[str, ...]

    def __repr__(self) -> str:
        states, inputs = self.B.shape[-2:]
        return f"LinearModel({states} states, {inputs} inputs; {', '.join(self.channels)})"


class _Commands(AbstractController):
    """The setpoint's value as the command."""

    def initial(self):
        return None

    def command(self, t, memory, measurement, setpoint):
        return setpoint.value

    def rate(self, t, memory, measurement, setpoint):
        return None


def linearise(
    arm: Arm,
    pose: Float[Array, " joints"],
    controller: AbstractController | None = None,
    channels: Sequence[str] | None = None,
) -> LinearModel:
    """`arm` about rest at `pose` [rad], open loop or closed by `controller`.

    `channels`: the outputs wanted, by name; all of `simulate` by default. There are also
    `curvature_i` [1/m] and `curvature_rate_i` [1/(m s)] at the strain gauge of link i.

    The arm is taken undeflected, so with gravity the result holds where its sag is
    small. Voltage limits and friction enter by their slope at rest.

    **Raises** `ValueError` for a sampled controller, whose loop is no `x' = A x`:
    `cut_loop` takes both kinds.
    """
    if controller is not None and controller.period() is not None:
        raise ValueError("linearise: the controller is sampled, so its loop is no x' = A x; use cut_loop.")
    # the arm's constants are computed by a program of their own, compiled once for all callers
    return _linearise(arm.assemble(), pose, controller, None if channels is None else tuple(channels))


@one_off
def _linearise(
    model: AssembledArm,
    pose: Float[Array, " joints"],
    controller: AbstractController | None,
    channels: tuple[str, ...] | None,
) -> LinearModel:
    joints = len(model.joints)
    closed = controller is not None
    law = controller if closed else _Commands()
    inputs = 3 * joints if closed else joints
    rest = Plant(model, law, _Setpoint(Setpoint((), (), ())), None, None).rest(tuple(scalar(a) for a in pose))
    flat, unflatten = ravel_pytree(rest)
    bias = tuple(pose) if closed else (scalar(0.0),) * joints

    def plant(u):
        u = jnp.concatenate([u, jnp.zeros(3 * joints - inputs)])
        value = tuple(b + du for b, du in zip(bias, u[:joints], strict=True))
        setpoint = Setpoint(value, tuple(u[joints : 2 * joints]), tuple(u[2 * joints :]))
        return Plant(model, law, _Setpoint(setpoint), None, None)

    def slope(x, u):
        return ravel_pytree(derivative(scalar(0.0), unflatten(x), plant(u)))[0]

    names = channel_names(model) if channels is None else channels

    def outputs(x, u):
        state: State = unflatten(x)
        loop = plant(u)
        drives = loop.drives(scalar(0.0), state)
        accelerated = any(name.startswith("tip_acceleration") for name in names)
        qdd = loop.accelerations(scalar(0.0), state, drives) if accelerated else None
        found = read_channels(model, state.q, state.qd, drives, qdd)
        reading = loop.measurement(state)
        for i in range(len(model.arm.links)):
            found[f"curvature_{i + 1}"] = reading.curvature[i]
            found[f"curvature_rate_{i + 1}"] = reading.curvature_rate[i]
        return jnp.array([found[name] for name in names])

    zero = jnp.zeros(inputs)
    a, b = jax.jacfwd(slope, (0, 1))(flat, zero)
    c, d = jax.jacfwd(outputs, (0, 1))(flat, zero)
    return LinearModel(a, b, c, d, names)


class Modes(NamedTuple):
    """Modes of a linear model: `frequency` [Hz] (undamped), `damping_ratio`, and `poles` [rad/s].

    One entry for every pole of non-negative imaginary part, by rising frequency;
    entries of real poles have a damping ratio of 1 (or -1 if unstable).
    """

    frequency: Float[Array, " modes"]
    damping_ratio: Float[Array, " modes"]
    poles: Complex[Array, " modes"]

    def __repr__(self) -> str:
        if isinstance(self.poles, Tracer) or self.poles.ndim > 1:
            return f"Modes({self.poles.shape})"
        rows = [
            f"  {float(f):10.4g} Hz  damping ratio {float(z):8.4g}"
            for f, z in zip(self.frequency, self.damping_ratio, strict=True)
        ]
        return "\n".join(["Modes", *rows])


def closed_loop_modes(linear: LinearModel) -> Modes:
    """Modes of `x' = A x`, from its eigenvalues; call it outside of `jit`, on one model."""
    modes, count = _modes(linear.A)
    return Modes(*(column[: int(count)] for column in modes))


@one_off
def _modes(a: Float[Array, "states states"]) -> tuple[Modes, Int[Array, ""]]:
    """All poles as modes, those of negative imaginary part last, and how many come before these."""
    poles = jnp.linalg.eigvals(a)
    poles = poles[jnp.lexsort((jnp.abs(poles), poles.imag < 0))]
    size = jnp.abs(poles)
    ratio = -poles.real / jnp.where(size > 0, size, 1.0)
    return Modes(size / (2 * jnp.pi), ratio, poles), jnp.sum(poles.imag >= 0)
