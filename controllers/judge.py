"""What an objective says of points, with its gradient there, on as many cores as there are parameters for.

Forward mode follows every parameter by itself. So a gradient comes in groups of directions,
all by one program, that run side by side; each computes the cost as well.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import diffrax
import equinox as eqx
import jax
import numpy as np
from jaxtyping import Array, Float, PyTree

from jaxflex import Scalar, adjoint_for, kept, value_and_gradient, value_and_slopes

Free = Float[Array, " free"]
Starts = Float[Array, "starts free"]
Objective = Callable[[Free, PyTree], tuple[Scalar, PyTree]]
TOGETHER = 8  # parameters at most that one core follows; one more costs it 0.6 of a simulation


class Judged(NamedTuple):
    """Points judged, a row each: `cost`, `aux` and the `gradient` of the cost."""

    cost: Float[Array, " starts"]
    aux: PyTree
    gradient: Float[np.ndarray, "starts free"] | Starts


def judge(objective: Objective, points: Starts, args: PyTree, own: PyTree) -> Judged:
    """`objective` at every point with `(args, own)`, `own` with a leading axis of points, and its gradients."""
    count = points.shape[1]
    if not isinstance(adjoint_for(count), diffrax.ForwardMode):
        (cost, aux), gradient = _backwards(objective, points, args, own)
        return Judged(cost, aux, gradient)
    first, *others = groups(count, points.dtype)

    def along(group):
        found, slopes = _along(objective, points, group, args, own)
        return found, np.asarray(slopes)

    with ThreadPoolExecutor(max(len(others), 1)) as pool:
        elsewhere = [pool.submit(along, group) for group in others]
        (cost, aux), slopes = along(first)
        rest = [done.result()[1] for done in elsewhere]
    return Judged(cost, aux, np.concatenate([slopes, *rest], axis=1)[:, :count])


def groups(count: int, dtype: np.dtype) -> Float[np.ndarray, "groups directions {count}"]:
    """The directions of all parameters in groups of one size, the last filled up with directions that lead nowhere."""
    number = -(-count // TOGETHER)
    size = -(-count // number)
    return np.eye(number * size, count, dtype=dtype).reshape(number, size, count)


@kept
def _along(objective: Objective, points: Starts, group: Float[Array, "directions free"], args, own):
    return each(
        lambda x, o: value_and_slopes(lambda y: objective(y, (args, o)), has_aux=True)(x, group), points, own
    )


@kept
def _backwards(objective: Objective, points: Starts, args: PyTree, own: PyTree):
    return each(
        lambda x, o: value_and_gradient(lambda y: objective(y, (args, o)), has_aux=True)(x), points, own
    )


def each(function: Callable, free: Starts, *rest: PyTree) -> PyTree:
    """`function` of every row; of a single one without the layer of `vmap`, which takes long to trace."""
    if free.shape[0] > 1:
        return eqx.filter_vmap(function)(free, *rest)
    row = jax.tree_util.tree_map(lambda x: x[0] if eqx.is_array(x) else x, (free, *rest))
    return jax.tree_util.tree_map(lambda x: x[None] if eqx.is_array(x) else x, function(*row))
