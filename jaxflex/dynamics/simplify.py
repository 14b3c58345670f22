"""Trace a function once and drop what autodiff computed twice or for nobody.

Nested derivatives leave a program in which most equations are repeated or unused. XLA
removes them in the end, but only after JAX has batched, differentiated and lowered each:
most of the time before a first simulation went there. Here the program is cleaned right
after it is traced, before anything is done with it.
"""

# the abstract values of arrays have attributes that their base class does not declare
# pyright: reportAttributeAccessIssue=false

from collections.abc import Callable
from functools import wraps
from typing import Any

import equinox as eqx
import jax
import jax.tree_util as jtu
from jax.extend import core


def simplified(function: Callable) -> Callable:
    """`function` of pytrees of arrays, its program traced, cleaned and cached."""
    return eqx.filter_jit(cleaned(function))


def cleaned(function: Callable) -> Callable:
    """The same as a part of a larger program, which can be cleaned as one."""

    @wraps(function)
    def call(*args):
        return traced(function, *args)(*args)

    return call


def traced(function: Callable, *args: Any) -> Callable:
    """`function` of pytrees like `args` as its cleaned program, which is quickly differentiated many times."""
    arrays, static = eqx.partition(args, eqx.is_array)
    leaves, tree = jtu.tree_flatten(arrays)

    def flat(*leaves):
        return function(*eqx.combine(jtu.tree_unflatten(tree, leaves), static))

    program, shape = jax.make_jaxpr(flat, return_shape=True)(*leaves)
    run = core.jaxpr_as_fun(without_waste(program))

    def call(*args):
        outputs = run(*jtu.tree_leaves(eqx.filter(args, eqx.is_array)))
        return jtu.tree_unflatten(jtu.tree_structure(shape), outputs)

    return call


def without_waste(program: core.ClosedJaxpr) -> core.ClosedJaxpr:
    """The same program without equal equations computed twice, idle ones, and unused ones.

    A product with zero is zero here, as it is for the finite numbers that a model is made of.
    """
    same: dict = {}  # variable -> the equal variable or literal that stands for it
    first: dict = {}  # operation and operands -> its results
    kept = []
    for equation in program.jaxpr.eqns:
        operands = [v if isinstance(v, core.Literal) else same.get(v, v) for v in equation.invars]
        idle = _idle(equation, operands)
        if idle is not None:
            same[equation.outvars[0]] = idle
            continue
        key = _key(equation, operands)
        if key is not None and key in first:
            same.update(zip(equation.outvars, first[key], strict=True))
            continue
        if key is not None:
            first[key] = equation.outvars
        kept.append(equation.replace(invars=operands))
    results = [v if isinstance(v, core.Literal) else same.get(v, v) for v in program.jaxpr.outvars]
    needed = {v for v in results if not isinstance(v, core.Literal)}
    useful = []
    for equation in reversed(kept):
        if equation.effects or any(v in needed for v in equation.outvars):
            useful.append(equation)
            needed.update(v for v in equation.invars if not isinstance(v, core.Literal))
    jaxpr = program.jaxpr.replace(eqns=useful[::-1], outvars=results)
    return core.ClosedJaxpr(jaxpr, program.consts)


def _idle(equation: core.JaxprEqn, operands: list):
    """The operand that an equation over scalars does no more than repeat, or None."""
    name, aval = equation.primitive.name, equation.outvars[0].aval
    if aval.shape or any(v.aval.shape or v.aval.dtype != aval.dtype for v in operands):
        return None
    if name == "convert_element_type":
        return operands[0] if operands[0].aval.weak_type == aval.weak_type else None
    if len(operands) != 2:
        return None
    x, y = operands
    for value, other in ((x, y), (y, x)):
        if not isinstance(value, core.Literal) or other.aval.weak_type != aval.weak_type:
            continue
        if name in ("add", "add_any") and value.val == 0:
            return other
        if name == "mul" and value.val == 1:
            return other
        if name == "mul" and value.val == 0 and value.aval.weak_type == aval.weak_type:
            return value
    harmless = {"sub": 0, "div": 1}.get(name)
    if isinstance(y, core.Literal) and x.aval.weak_type == aval.weak_type and y.val == harmless:
        return x
    return None


def _key(equation: core.JaxprEqn, operands: list):
    """What makes an equation equal to another, or None if it must stand for itself."""
    if equation.effects:
        return None
    names = tuple(
        (v.val.item(), str(v.aval)) if isinstance(v, core.Literal) and getattr(v.val, "ndim", 1) == 0
        else (v.val, str(v.aval)) if isinstance(v, core.Literal)
        else v
        for v in operands
    )  # fmt: skip
    key = (equation.primitive, names, tuple(equation.params.items()))
    try:
        hash(key)
    except TypeError:
        return None
    return key
