"""One function, differentiated forwards by one implementation and backwards by another.

A loop that stops when it is done can be differentiated forwards as it is, and
backwards only with checkpoints; JAX's loops support one or the other. The derivative is
the same linear map either way, so both can serve one function: its push-forward through
the first, its transpose through the second.
"""

from collections.abc import Callable
from typing import Any

import diffrax
import equinox as eqx
import equinox.internal as eqxi
import jax
import jax.numpy as jnp
import jax.tree_util as jtu
from jaxtyping import Array, Float, PyTree

FEW = 24  # parameters up to which forward mode is the better one, compilation counted


def adjoint_for(parameters: int) -> diffrax.AbstractAdjoint:
    """How `simulate` is best differentiated for this many parameters; for its `adjoint`.

    One forward pass carries all parameters side by side and costs about 0.6 of the
    simulation for each; going backwards costs about 5 of it for any number, and twice
    the time to compile (`experiments/benchmarks`, gradients).
    """
    return diffrax.ForwardMode() if parameters <= FEW else diffrax.RecursiveCheckpointAdjoint()


def value_and_gradient(function: Callable[[Float[Array, " n"]], Any], has_aux: bool = False):
    """`x -> (function(x), gradient)`, forwards for few parameters and backwards for many.

    With `has_aux`, `function` returns its value and whatever else is worth knowing.

    Pass `adjoint=adjoint_for(n)` to the simulations inside, which then compile for one
    mode alone.
    """

    def call(x: Float[Array, " n"]) -> tuple[Any, Float[Array, " n"]]:
        if x.shape[0] > FEW:
            return jax.value_and_grad(function, has_aux=has_aux)(x)
        return value_and_slopes(function, has_aux)(x, jnp.eye(x.shape[0], dtype=x.dtype))

    return call


def value_and_slopes(function: Callable[[Float[Array, " n"]], Any], has_aux: bool = False):
    """`(x, directions) -> (function(x), slopes)`: how the value changes along each of some directions, forwards.

    All directions of a call go side by side; calls for some of them each may go on
    different cores. `has_aux` as for `value_and_gradient`.
    """

    def call(
        x: Float[Array, " n"], directions: Float[Array, "directions n"]
    ) -> tuple[Any, Float[Array, " directions"]]:
        def twice(x):
            found = function(x)
            return (found[0] if has_aux else found), found

        def along(direction):
            _, slope, found = jax.jvp(twice, (x,), (direction,), has_aux=True)
            return slope, found

        slopes, found = jax.vmap(along, out_axes=(0, None))(directions)
        return found, slopes

    return call


def both_modes(forward: Callable[[PyTree], PyTree], reverse: Callable[[PyTree], PyTree]):
    """`x -> forward(x)`, with `jvp` through `forward` and `vjp` through `reverse`.

    Both must compute the same function of a pytree, `forward` being forward- and
    `reverse` reverse-differentiable. Only the leaves that are being differentiated get
    tangents. Differentiating twice is refused with an error.

    The pair is handed to JAX as a linear solve with the identity, the one public
    operation that takes a linear map together with its transpose.
    """

    @eqx.filter_custom_jvp
    def call(x):
        return forward(x)

    @call.def_jvp
    def _(primals, tangents):
        (x,), (tangent,) = primals, tangents
        out = call(x)
        x = eqxi.nondifferentiable(x, name="The derivative of `simulate`")
        active = jtu.tree_map(lambda t, v: None if t is None else v, tangent, x, is_leaf=_is_none)
        rest = jtu.tree_map(lambda t, v: v if t is None else None, tangent, x, is_leaf=_is_none)

        def through(function, a):
            return eqx.filter(function(eqx.combine(a, rest)), eqx.is_inexact_array)

        # zeros, but linear in the tangent, as all that a linear solve is given has to be
        nothing = sum(0 * jnp.sum(t) for t in jtu.tree_leaves(tangent))
        blank = jtu.tree_map(
            lambda leaf: jnp.zeros_like(leaf) + nothing, eqx.filter(out, eqx.is_inexact_array)
        )
        guard = jtu.tree_leaves(active)[0]

        def identity(b):
            # the guard makes a second derivative meet `nondifferentiable` instead of zero
            return jtu.tree_map(lambda leaf: leaf + 0 * jnp.sum(guard), b)

        def push(_, b):
            t, _ = b
            _, pushed = jax.jvp(lambda a: through(forward, a), (active,), (t,))
            return jtu.tree_map(jnp.zeros_like, t), pushed

        def pull(_, b):
            _, cotangent = b
            _, vjp = jax.vjp(lambda a: through(reverse, a), active)
            return vjp(cotangent)[0], jtu.tree_map(jnp.zeros_like, cotangent)

        _, pushed = jax.lax.custom_linear_solve(identity, (tangent, blank), push, pull)
        return out, pushed

    return call


def _is_none(leaf) -> bool:
    return leaf is None
