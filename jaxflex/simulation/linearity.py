"""Is a loop linear, and its input a polynomial of time? Read off the program of its derivative.

Every value in that program is given a degree: whether it depends on the state, and as what
power of time. Degrees go from operation to operation by the rules of polynomials (a product of
two values that depend on the state is not linear, its sine neither), so that the answer is a
matter of structure: a friction of zero is still friction.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import jax.tree_util as jtu
from jax.extend import core

from .plant import Plant, State, derivative

ANY = float("inf")  # a function of time that is no polynomial
SUMS = {
    "add", "add_any", "sub", "neg", "copy", "copy_p", "convert_element_type", "broadcast_in_dim", "reshape",
    "squeeze", "concatenate", "transpose", "slice", "reduce_sum", "cumsum", "pad", "expand_dims", "rev",
    "stack", "unstack", "split",
}  # fmt: skip
INNER = ("jaxpr", "call_jaxpr")


class Degree(NamedTuple):
    """Of a value: in the state (0, 1, or 2 for what is not linear with constant coefficients), in time."""

    state: int
    time: float


CONSTANT, NONLINEAR = Degree(0, 0), Degree(2, ANY)


def degree(plant: Plant, state: State) -> Degree:
    """The highest degrees in the derivative of `state`; works on traced values."""
    given = (plant, state)
    leaves, tree = jtu.tree_flatten(eqx.filter(given, eqx.is_array))
    others, shape = jtu.tree_flatten(eqx.filter(given, eqx.is_array, inverse=True))
    asked = _Question(tuple((x.shape, x.dtype) for x in leaves), tree, tuple(others), shape)
    try:
        return _degree(asked)
    except TypeError:  # a model that cannot be looked up because a part of it has no hash
        return _degree.__wrapped__(asked)


class _Question(NamedTuple):
    shapes: tuple
    tree: Any
    others: tuple
    shape: Any


@lru_cache(maxsize=256)
def _degree(asked: _Question) -> Degree:
    def rates(t, arrays):
        plant, state = eqx.combine(
            jtu.tree_unflatten(asked.tree, arrays), jtu.tree_unflatten(asked.shape, asked.others)
        )
        return derivative(t, state, plant)

    arrays = [jax.ShapeDtypeStruct(*given) for given in asked.shapes]
    program = jax.make_jaxpr(rates)(jax.ShapeDtypeStruct((), jnp.result_type(float)), arrays)
    plant, state = jtu.tree_unflatten(asked.tree, arrays)
    model = len(jtu.tree_leaves(plant))
    moving = len(jtu.tree_leaves(state))
    given = [Degree(0, 1), *[CONSTANT] * model, *[Degree(1, 0)] * moving]
    return _highest(_through(program.jaxpr, given))


def _through(program: core.Jaxpr, given: list[Degree]) -> list[Degree]:
    known: dict = dict.fromkeys(program.constvars, CONSTANT)
    known |= dict(zip(program.invars, given, strict=True))

    def read(v):
        return CONSTANT if isinstance(v, core.Literal) else known[v]

    for equation in program.eqns:
        operands = [read(v) for v in equation.invars]
        known |= dict(zip(equation.outvars, _results(equation, operands), strict=True))
    return [read(v) for v in program.outvars]


def _results(equation: core.JaxprEqn, operands: list[Degree]) -> list[Degree]:
    name, params, count = equation.primitive.name, equation.params, len(equation.outvars)
    if _highest(operands) == CONSTANT:
        return [CONSTANT] * count
    if name in SUMS:
        return [_highest(operands)] * count
    if name in RULES:
        return [RULES[name](operands, params)]
    if name == "custom_linear_solve":
        matrix = sum(params["const_lengths"])
        return [_highest(operands) if _highest(operands[:matrix]) == CONSTANT else _unknown(operands)] * count
    inner = next((params[key] for key in INNER if key in params), None)
    if inner is not None and name != "scan":
        program = getattr(inner, "jaxpr", inner)
        if len(program.invars) == len(operands):
            return _through(program, operands)
    return [_unknown(operands)] * count


def _highest(degrees: list[Degree]) -> Degree:
    return Degree(max((d.state for d in degrees), default=0), max((d.time for d in degrees), default=0))


def _unknown(operands: list[Degree]) -> Degree:
    return NONLINEAR if _highest(operands).state else Degree(0, ANY)


def _product(operands: list[Degree], _: Any = None) -> Degree:
    x, y = operands
    if x.state and y.state:
        return NONLINEAR
    if x.state or y.state:
        linear, factor = (x, y) if x.state else (y, x)
        return linear if factor == CONSTANT else NONLINEAR
    return Degree(0, x.time + y.time)


def _quotient(operands: list[Degree], _: Any) -> Degree:
    return operands[0] if operands[1] == CONSTANT else _unknown(operands)


def _power(operands: list[Degree], params: dict) -> Degree:
    (x,), n = operands, params.get("y", 2)
    if n == 1:
        return x
    return Degree(0, n * x.time) if n > 1 and not x.state else _unknown(operands)


def _choice(operands: list[Degree], _: Any) -> Degree:
    # pieces are told apart by time: where one ends is a jump, which the reference names
    return _highest(operands[1:]) if operands[0].state == 0 else NONLINEAR


def _bounded(operands: list[Degree], _: Any) -> Degree:
    return _highest(operands) if _highest(operands).state == 0 else NONLINEAR


def _part(operands: list[Degree], _: Any) -> Degree:
    return operands[0] if _highest(operands[1:]) == CONSTANT else _unknown(operands)


def _triangular(operands: list[Degree], _: Any) -> Degree:
    return operands[1] if operands[0] == CONSTANT else _unknown(operands)


RULES: dict[str, Callable[[list[Degree], Any], Degree]] = {
    "mul": _product,
    "dot_general": _product,
    "div": _quotient,
    "integer_pow": _power,
    "square": _power,
    "select_n": _choice,
    "max": _bounded,
    "min": _bounded,
    "clamp": _bounded,
    "dynamic_slice": _part,
    "gather": _part,
    "triangular_solve": _triangular,
}
