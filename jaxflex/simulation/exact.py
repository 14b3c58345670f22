"""Linear loops without steps: `x' = A x + b(t)` with b a polynomial between jumps.

From one time wanted to the next the state is multiplied by e^(hA) and the effect of the input
added, which does not depend on the state (`exponential`). Evenly spaced times, as they mostly
are, share one e^(hA); intervals in which the input jumps have its effect worked out piece by
piece. There is no error of integration, whatever the times.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float, Int

from .exponential import DEGREE, balance, moved, phi
from .linearity import degree
from .methods import AbstractMethod
from .plant import Plant, State, derivative

INTERVALS = 256  # fewer times have others put between them, that an interval be short
CHECKED = 0.37  # of a segment, where its polynomial is compared with the input
_NODES = 0.5 + 0.5 * np.polynomial.legendre.leggauss(DEGREE + 1)[0]
_INVERSE = np.linalg.inv(np.vander(_NODES, increasing=True))  # values at the nodes -> coefficients


class Exact(AbstractMethod):
    """The exact solution of a linear loop: no steps, and no error of them.

    A loop is linear if the arm has one joint, its link is rigid or has `motion="small"`, there
    is no voltage limit, dry friction, gravity or play, and the controller is linear and
    continuous (PD, strain-rate feedback, filters, LQG; not PID, whose integral is limited).
    `Arm.linear()` makes such an arm. The input must be a polynomial of at most degree 5 in time
    between its jumps: all moves and steps are, and either through any shaper. `simulate` takes
    this method by itself where both are certain by structure. Any other input is a failure with
    its reason.
    """


def suits(plant: Plant, start: State) -> bool:
    """True if the loop is linear, and its input polynomial between jumps, by their structure."""
    if plant.sample_time is not None or len(plant.model.joints) != 1:
        return False  # more joints multiply sines and cosines of angles
    found = degree(plant, start)
    return found.state <= 1 and found.time <= DEGREE


def require_linear(plant: Plant, start: State) -> None:
    """Raises `ValueError` for a loop that is sampled or not linear."""
    if plant.sample_time is not None:
        raise ValueError("Exact() needs continuous control; use Adaptive or Fixed for a sampled controller.")
    if degree(plant, start).state > 1:
        raise ValueError(
            "Exact() needs a linear loop, and this one is not: allowed is one joint, its link rigid or "
            "with motion='small', without voltage limit, dry friction, gravity and play, under a linear "
            "controller. arm.linear() leaves out what is not linear in an arm; else use Adaptive()."
        )


class _Segments(NamedTuple):
    """The input between jumps: `sum_k coefficients[k] ((t - begin) / length)^k`, one a segment."""

    begin: Float[Array, " segments"]
    length: Float[Array, " segments"]
    coefficients: Float[Array, "segments degrees n"]

    def slopes(self, segment: Int[Array, " pieces"], t: Float[Array, " pieces"], unit: Array) -> Array:
        """Value and derivatives at `t`, time counted in `unit`s, of the polynomials of these segments."""
        begin, length, c = self.begin[segment], self.length[segment], self.coefficients[segment]
        length = jnp.where(length > 0, length, 1.0)
        share = (t - begin) / length
        found = []
        for _ in range(DEGREE + 1):
            value = c[:, -1]
            for k in range(c.shape[1] - 2, -1, -1):
                value = value * share[:, None] + c[:, k]
            found.append(value)
            order = jnp.arange(1, c.shape[1])
            c = c[:, 1:] * order[:, None] * (unit / length)[:, None, None]
            c = c if c.shape[1] else jnp.zeros_like(c, shape=(c.shape[0], 1, c.shape[2]))
        return jnp.stack(found, axis=1)


def exact(
    plant: Plant,
    start: State,
    times: Float[Array, " times"],
    jumps: Float[Array, " jumps"],
    backwards: bool,
) -> tuple[State, Int[Array, ""], Bool[Array, ""]]:
    """States at `times` [s], the number of intervals, and whether the input was polynomial in each.

    `backwards`: keep what reverse mode needs; without, forward mode alone works.
    """
    x0, unflatten = ravel_pytree(start)
    zero, still = jnp.zeros_like(x0), jax.lax.stop_gradient(times)

    def rates(t, x):
        return ravel_pytree(derivative(t, unflatten(x), plant))[0]

    matrix = jax.jacfwd(rates, 1)(still[0], zero)
    scale = balance(matrix)
    matrix = matrix * scale[None, :] / scale[:, None]
    knots = jnp.sort(jnp.clip(jumps, still[0], still[-1]))
    segments, fits = _segments(lambda t: rates(t, zero) / scale, knots, still)
    parts = -(-INTERVALS // (still.shape[0] - 1))
    grid = _refined(still, parts)
    # a later start leaves out what would have happened until then
    x0 = x0 - rates(still[0], x0) * (times[0] - still[0])
    beside = _beside_jumps(matrix, segments, knots, grid, backwards)
    evenly = _are_even(still)

    def along(lengths):
        return _along(matrix, segments, knots, grid, beside, x0 / scale, lengths, backwards)

    gaps = jnp.diff(grid)
    mean = ((still[-1] - still[0]) / gaps.shape[0])[None]
    after = jax.lax.cond(evenly, lambda: along(mean), lambda: along(gaps))
    x = jnp.concatenate([x0[None], after[parts - 1 :: parts] * scale])
    # a later time sees the motion further on
    x = x + jax.vmap(rates)(still, x) * (times - still)[:, None]
    return jax.vmap(unflatten)(x), jnp.asarray(gaps.shape[0]), fits


def _refined(times: Float[Array, " times"], parts: int) -> Array:
    """`times` with every interval divided into equal `parts`."""
    share = jnp.arange(parts) / parts
    inner = times[:-1, None] + jnp.diff(times)[:, None] * share
    return jnp.concatenate([inner.ravel(), times[-1:]])


def _are_even(times: Float[Array, " times"]) -> Bool[Array, ""]:
    gaps = jnp.diff(times)
    return jnp.all(jnp.abs(gaps - gaps[0]) <= 8 * jnp.finfo(times.dtype).eps * jnp.abs(times).max())


def _segments(input_at, knots: Array, times: Array) -> tuple[_Segments, Bool[Array, ""]]:
    begin, end = jnp.concatenate([times[:1], knots]), jnp.concatenate([knots, times[-1:]])
    length = end - begin
    at = jnp.concatenate([_NODES, np.array([CHECKED])])
    values = jax.vmap(jax.vmap(input_at))(begin[:, None] + length[:, None] * at)
    samples, seen = values[:, :-1], values[:, -1]
    coefficients = jnp.einsum("kj,ijn->ikn", _INVERSE, samples)
    said = jnp.einsum("k,ikn->in", CHECKED ** np.arange(DEGREE + 1), coefficients)
    # between two instants that differ by rounding alone there is nothing to compare
    some = (length > 1e-9 * (times[-1] - times[0]))[:, None]
    missed = jnp.max(jnp.where(some, jnp.abs(seen - said), 0.0))
    allowed = 0.1 * jnp.finfo(times.dtype).eps ** 0.5 * jnp.abs(samples).max()
    return _Segments(begin, length, coefficients), jax.lax.stop_gradient(missed <= allowed)


def _beside_jumps(
    matrix: Array, segments: _Segments, knots: Array, grid: Array, backwards: bool
) -> tuple[Int[Array, " jumps"], Float[Array, "jumps n"]]:
    """Intervals in which the input jumps, and what each jump's pieces add to the state at their end."""
    count = knots.shape[0]
    interval = jnp.clip(
        jnp.searchsorted(grid, jax.lax.stop_gradient(knots), side="right") - 1, 0, grid.shape[0] - 2
    )
    lower, upper = grid[interval], grid[interval + 1]
    earlier = jnp.concatenate([grid[:1], knots[:-1]])
    # from the jump before, or the beginning of the interval, to the jump
    begin = jnp.concatenate([jnp.where(earlier >= lower, earlier, lower), knots])
    # and from the last jump in an interval to its end
    last = jnp.concatenate([interval[1:] != interval[:-1], jnp.ones(min(count, 1), bool)])
    end = jnp.concatenate([knots, jnp.where(last, upper, knots)])
    number = jnp.arange(count)
    longest = jnp.max(jnp.diff(grid))
    slopes = segments.slopes(jnp.concatenate([number, number + 1]), begin, jnp.ones(2 * count))
    nothing = jnp.zeros((2 * count, matrix.shape[0]), matrix.dtype)
    pushed = moved(matrix, nothing, slopes, end - begin, longest, backwards)
    left = jnp.concatenate([upper, upper]) - end
    carried = moved(matrix, pushed, slopes[:, :0], left, longest, backwards)
    return interval, carried[:count] + carried[count:]


def _along(
    matrix: Array, segments: _Segments, knots: Array, grid: Array, beside, x0: Array, lengths: Array,
    backwards: bool,
) -> Array:  # fmt: skip
    """States at the end of every interval; `lengths` of each, or one for all."""
    powers = phi(matrix, lengths, backwards)
    count = grid.shape[0] - 1
    number = jnp.searchsorted(jax.lax.stop_gradient(knots), grid[:-1], side="right")
    # sum_k k! phi_(k+1) c_k is a sum over derivatives
    unit = jnp.broadcast_to(lengths, (count,))
    slopes = segments.slopes(number, grid[:-1], unit)
    if lengths.shape[0] == 1:
        pushed = lengths[0] * jnp.einsum("ikn,kmn->im", slopes, powers[1:, 0])
    else:
        pushed = lengths[:, None] * jnp.einsum("ikn,kimn->im", slopes, powers[1:])
    interval, carried = beside
    jumped = jnp.zeros(count, bool).at[interval].set(True)
    pushed = jnp.where(jumped[:, None], 0.0, pushed).at[interval].add(carried)

    if lengths.shape[0] == 1:
        turn = powers[0, 0]
        return jax.lax.scan(lambda x, f: (y := turn @ x + f, y), x0, pushed)[1]
    return jax.lax.scan(lambda x, given: (y := given[0] @ x + given[1], y), x0, (powers[0], pushed))[1]
