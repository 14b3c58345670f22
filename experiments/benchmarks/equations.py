"""Equations of motion in symbols, from the library's energies, for compilers other than XLA.

The energies are traced to a JAX program, which is replayed over sympy expressions; mass
matrix and bias then follow by sympy's differentiation. No equation is written twice.
"""

from typing import NamedTuple

import jax
import jax.tree_util as jtu
import numpy as np
import sympy as sp
from jax.extend import core

import jaxflex as jf

UNARY = {"neg": lambda x: -x, "copy": lambda x: x}
BINARY = {
    "add": lambda x, y: x + y,
    "add_any": lambda x, y: x + y,
    "sub": lambda x, y: x - y,
    "mul": lambda x, y: x * y,
    "div": lambda x, y: x / y,
}


def replay(program: core.Jaxpr, constants: list, inputs: list) -> list:
    """The outputs of a program of scalars, evaluated over sympy expressions."""
    known = dict(zip(program.constvars, constants, strict=True))
    known |= dict(zip(program.invars, inputs, strict=True))

    def read(v):
        return sp.Float(float(v.val)) if isinstance(v, core.Literal) else known[v]

    for equation in program.eqns:
        operands, name = [read(v) for v in equation.invars], equation.primitive.name
        inner = equation.params.get("jaxpr") or equation.params.get("call_jaxpr")
        if inner is not None:
            results = replay(inner.jaxpr, inner.consts, operands)
        elif name in UNARY:
            results = [UNARY[name](*operands)]
        elif name in BINARY:
            results = [BINARY[name](*operands)]
        elif name == "sin_cos":
            results = [sp.sin(*operands), sp.cos(*operands)]
        elif name == "integer_pow":
            results = [operands[0] ** equation.params["y"]]
        elif name in ("convert_element_type", "broadcast_in_dim"):
            results = operands
        else:
            raise NotImplementedError(f"no sympy form of {name}")
        known |= dict(zip(equation.outvars, results, strict=True))
    return [read(v) for v in program.outvars]


class Equations(NamedTuple):
    """`mass @ qdd = force - bias` over symbols, and the arms' parameters that appear in them.

    `parameters` has a row an arm, in the order of `symbols`; what is the same for all arms
    is a number in the expressions.
    """

    q: list[sp.Symbol]
    qd: list[sp.Symbol]
    symbols: list[sp.Symbol]
    parameters: np.ndarray
    mass: sp.Matrix
    bias: list[sp.Expr]
    damping: list[sp.Expr]


def equations(models: jf.AssembledArm) -> Equations:
    """Equations of motion of a batch of assembled arms, leading axis the arm."""
    leaves, tree = jtu.tree_flatten(models)
    columns = [np.asarray(leaf) for leaf in leaves]
    varies = [bool(np.ptp(column) > 0) for column in columns]
    symbols = [sp.Symbol(f"p{i}") for i, v in enumerate(varies) if v]
    names = iter(symbols)
    inputs = [next(names) if v else sp.Float(float(c.flat[0])) for v, c in zip(varies, columns, strict=True)]
    inputs = [sp.Integer(0) if value == 0 else value for value in inputs]
    one = jtu.tree_map(lambda leaf: leaf[0], models)
    n = one.size
    q, qd = list(sp.symbols(f"q:{n}")), list(sp.symbols(f"v:{n}"))

    def quantities(leaves, q, qd):
        model = jtu.tree_unflatten(tree, leaves)
        kinetic, potential = jf.kinetic_energy(model, q, qd), jf.potential_energy(model, q)
        return kinetic, potential, model.damping()

    zeros = tuple(jax.numpy.zeros(()) for _ in range(n))
    program = jax.make_jaxpr(quantities)(jtu.tree_leaves(one), zeros, zeros)
    kinetic, potential, *damping = replay(program.jaxpr, program.consts, [*inputs, *q, *qd])
    momentum = [sp.diff(kinetic, v) for v in qd]
    mass = sp.Matrix(n, n, lambda i, j: sp.diff(momentum[max(i, j)], qd[min(i, j)]))
    bias = [
        sum(sp.diff(p, x) * v for x, v in zip(q, qd, strict=True)) - sp.diff(kinetic - potential, x)
        for p, x in zip(momentum, q, strict=True)
    ]
    parameters = np.stack([c for c, v in zip(columns, varies, strict=True) if v], axis=1)
    return Equations(q, qd, symbols, parameters, mass, bias, damping)
