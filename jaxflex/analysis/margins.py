"""How far a control loop is from instability: gain, phase and modulus margins, and its decay.

The loop is made linear about a resting place and cut where the command of one joint
enters its drive, the other joints left closed. With `u` put in there and `v` what the
controller then asks for, `L = -v/u` is the gain around the loop; it must not meet -1.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Complex, Float

from ..arm.arm import Arm, AssembledArm
from ..control import AbstractController, Setpoint
from ..one_off import one_off
from ..scalars import Scalar, scalar
from ..simulation.plant import Plant, derivative
from .linear import resting_reference

GRID, AROUND, CROSSINGS, HALVINGS = 400, 24, 12, 50


class Margins(NamedTuple):
    """Margins of a loop, an entry a joint but for `decay`; of a loop that is stable, or they mean nothing.

    - `gain`: the smallest factor above 1 on the joint's command at which the loop starts
      to swing (infinite if there is none), and `gain_down` the largest below 1 (or zero)
    - `phase` [rad]: the smallest angle between `L` and -1 where `|L| = 1` (infinite if nowhere)
    - `modulus`: the least distance of `L` from -1, at most 1 for a loop that rolls off
    - `decay` [1/s]: slowest decay of the closed loop, all joints closed; negative if unstable
    """

    gain: Float[Array, " joints"]
    gain_down: Float[Array, " joints"]
    phase: Float[Array, " joints"]
    modulus: Float[Array, " joints"]
    decay: Scalar


class CutLoop(NamedTuple):
    """A loop cut at every command: `x' = A x + B u`, `v = C x`, commands u put in, v asked for.

    The state x is that of the arm, then the controller's memory. With a `period` [s] it
    is `x+ = A x + B u` from sample to sample, the commands held.
    """

    A: Float[Array, "states states"]
    B: Float[Array, "states joints"]
    C: Float[Array, "joints states"]
    period: Scalar | None

    def gain(self, joint: int, frequency: Float[Array, " frequencies"]) -> Complex[Array, " frequencies"]:
        """`L` at `frequency` [rad/s] around one joint (from 0), the others closed."""
        around = self.closed(joint)
        s = 1j * frequency
        points = s if self.period is None else jnp.exp(s * self.period)

        def one(point):
            across = point * jnp.eye(around.shape[0]) - around
            return -self.C[joint] @ jnp.linalg.solve(across, self.B[:, joint] + 0j)

        return jax.vmap(one)(points)

    def closed(self, cut: int | None = None) -> Float[Array, "states states"]:
        """A of the loop closed at every joint, or at all but one that stays `cut`."""
        return self.A + (self.B * (jnp.arange(self.B.shape[1]) != (-1 if cut is None else cut))) @ self.C

    def poles(self, cut: int | None = None) -> Complex[Array, " states"]:
        """Poles [rad/s] of the loop closed at every joint, or at all but one that stays `cut`."""
        poles = jnp.linalg.eigvals(self.closed(cut))
        if self.period is None:
            return poles
        # a deadbeat pole at zero decays as fast as can be told
        return jnp.log(jnp.where(jnp.abs(poles) > 1e-12, poles, 1e-12)) / self.period


def cut_loop(arm: Arm, pose: Float[Array, " joints"], controller: AbstractController) -> CutLoop:
    """The loop of `arm` and `controller` about rest at `pose` [rad], cut at every command."""
    # the arm's constants are computed by a program of their own, compiled once for all callers
    return _cut_loop(arm.assemble(), pose, controller)


@one_off
def _cut_loop(model: AssembledArm, pose: Float[Array, " joints"], controller: AbstractController) -> CutLoop:
    zero, period = scalar(0.0), controller.period()
    angles = tuple(scalar(a) for a in pose)
    reference = resting_reference(Setpoint(angles, (zero,) * len(angles), (zero,) * len(angles)))
    plant = Plant(model, controller, reference, None, scalar(1.0))
    rest = plant.rest(angles)
    flat, unflatten = ravel_pytree(rest._replace(memory=None, held=None))
    memory, unflatten_memory = ravel_pytree(rest.memory)

    def slope(x, u):
        moved = derivative(zero, unflatten(x)._replace(held=tuple(u)), plant)
        return ravel_pytree(moved._replace(memory=None, held=None))[0]

    def law(function):
        def of(m, x):
            return ravel_pytree(function(unflatten_memory(m), plant.measurement(unflatten(x))))[0]

        return jax.jacfwd(of, (0, 1))(memory, flat)

    setpoint = reference.setpoint(zero)
    h, j = law(lambda m, y: controller.command(zero, m, y, setpoint))
    a, b = jax.jacfwd(slope, (0, 1))(flat, jnp.zeros(len(angles)))
    if period is None:
        f, g = law(lambda m, y: controller.rate(zero, m, y, setpoint))
    else:
        f, g = law(lambda m, y: controller.advance(period, zero, m, y, setpoint))
        a, b = held(a, b, period)
    n, k = flat.shape[0], memory.shape[0]
    whole = jnp.block([[a, jnp.zeros((n, k))], [g.reshape(k, n), f.reshape(k, k)]])
    into = jnp.concatenate([b, jnp.zeros((k, len(angles)))])
    out = jnp.concatenate([j.reshape(len(angles), n), h.reshape(len(angles), k)], axis=1)
    return CutLoop(whole, into, out, period)


def held(
    a: Float[Array, "states states"], b: Float[Array, "states inputs"], period: Scalar
) -> tuple[Float[Array, "states states"], Float[Array, "states inputs"]]:
    """`x' = a x + b u` from sample to sample with `u` held: `expm([[a, b], [0, 0]] period)`."""
    n, m = b.shape
    block = jnp.zeros((n + m, n + m)).at[:n, :n].set(a).at[:n, n:].set(b)
    whole = jax.scipy.linalg.expm(block * period)
    return whole[:n, :n], whole[:n, n:]


def margins(arm: Arm, pose: Float[Array, " joints"], controller: AbstractController) -> Margins:
    """Margins of `arm` under `controller` about rest at `pose` [rad].

    Works under `vmap` (over payloads) and `grad`; the crossings are found by bisection and
    differentiated as what they are, solutions of an equation. A grid of frequencies, dense
    about every pole, brackets them. Sampled loops are taken as sampled.
    """
    return _all_margins(cut_loop(arm, pose, controller))


@one_off
def _all_margins(loop: CutLoop) -> Margins:
    grid = _grid(loop)
    gain, down, phase, modulus = zip(*(_margins(loop, i, grid) for i in range(loop.B.shape[1])), strict=True)
    decay = -jnp.max(loop.poles().real)
    return Margins(jnp.stack(gain), jnp.stack(down), jnp.stack(phase), jnp.stack(modulus), decay)


def _grid(loop: CutLoop) -> Float[Array, " frequencies"]:
    """Ascending frequencies [rad/s], uniform in the logarithm and dense about every pole."""
    poles = [loop.poles(cut) for cut in (None, *range(loop.B.shape[1]))]
    poles = jax.lax.stop_gradient(jnp.concatenate(poles))
    size = jnp.abs(poles)
    counted = size > 1e-6 * jnp.max(size)
    low = jnp.min(jnp.where(counted, size, jnp.inf)) / 100
    high = jnp.max(size) * 10
    width = jnp.maximum(jnp.abs(poles.real), 1e-4 * size)
    near = jnp.abs(poles.imag)[:, None] + width[:, None] * jnp.sinh(jnp.linspace(-4.0, 4.0, AROUND))
    if loop.period is not None:
        # a little past half the sampling frequency, where L is real and may cross the axis
        high = 1.001 * jnp.pi / jax.lax.stop_gradient(loop.period)
    wide = jnp.geomspace(low, high, GRID)
    return jnp.sort(jnp.clip(jnp.concatenate([wide, near.ravel()]), low, high))


def _margins(loop: CutLoop, joint: int, grid: Float[Array, " frequencies"]) -> tuple:
    fixed = jax.lax.stop_gradient(loop)

    def gain(w, loop=loop):
        return loop.gain(joint, w)

    values = gain(grid, fixed)
    least = grid[jnp.argmin(jnp.abs(1 + values))]
    ends = (
        jnp.max(jnp.where(grid < least, grid, grid[0])),
        jnp.min(jnp.where(grid > least, grid, grid[-1])),
    )
    nearest = _lowest(lambda w: jnp.abs(1 + gain(w[None], fixed)[0]), *ends)
    modulus = jnp.abs(1 + gain(nearest[None])[0])

    real_axis = (jnp.diff(jnp.sign(values.imag)) != 0) & (values.real[:-1] < 0) & (values.real[1:] < 0)
    at, there = _crossings(real_axis, grid, lambda w, loop: gain(w, loop).imag, loop)
    factor = 1 / jnp.where(there, jnp.abs(gain(at)), 1.0)
    up = jnp.min(jnp.where(there & (factor > 1), factor, jnp.inf))
    down = jnp.max(jnp.where(there & (factor < 1), factor, 0.0))

    unit_circle = jnp.diff(jnp.sign(jnp.abs(values) - 1)) != 0
    at, there = _crossings(unit_circle, grid, lambda w, loop: jnp.log(jnp.abs(gain(w, loop))), loop)
    phase = jnp.min(jnp.where(there, jnp.abs(jnp.angle(-gain(at))), jnp.inf))
    return up, down, phase, modulus


def _crossings(
    bracketed: Array, grid: Float[Array, " frequencies"], function: Callable, loop: CutLoop
) -> tuple[Float[Array, " crossings"], Array]:
    """Where `function` is zero, at most twelve of the brackets, and which of these are any."""
    index = jnp.nonzero(bracketed, size=CROSSINGS, fill_value=-1)[0]
    there = index >= 0
    fixed = jax.lax.stop_gradient(loop)
    low, high = grid[jnp.maximum(index, 0)], grid[jnp.maximum(index, 0) + 1]
    sign = jnp.sign(function(low, fixed))

    def halve(_, ends):
        low, high = ends
        middle = (low + high) / 2
        same = jnp.sign(function(middle, fixed)) == sign
        return jnp.where(same, middle, low), jnp.where(same, high, middle)

    low, high = jax.lax.fori_loop(0, HALVINGS, halve, (low, high))
    root = jax.lax.stop_gradient((low + high) / 2)
    # one Newton step moves the root by rounding only, and gives it the derivative of a root
    slope = jax.jvp(lambda w: function(w, fixed), (root,), (jnp.ones_like(root),))[1]
    slope = jax.lax.stop_gradient(jnp.where(there & (slope != 0), slope, 1.0))
    return jnp.where(there, root - function(root, loop) / slope, root), there


def _lowest(function: Callable, low: Scalar, high: Scalar) -> Scalar:
    """The place of the lowest value between two ends, by golden section."""
    share = (5**0.5 - 1) / 2

    def shrink(_, ends):
        low, high = ends
        a, b = high - share * (high - low), low + share * (high - low)
        left = function(a) < function(b)
        return jnp.where(left, low, a), jnp.where(left, b, high)

    low, high = jax.lax.fori_loop(0, HALVINGS, shrink, (low, high))
    return jax.lax.stop_gradient((low + high) / 2)
