"""Sine and cosine together, as a polynomial that compilers vectorise.

XLA on a CPU calls the C library for each sine and cosine in double precision, one lane
after the other, and again in every loop that needs the value. Here they are additions and
multiplications: the nearest multiple of pi/2 is taken off in three parts (Cody and Waite
1980), and what is left, within pi/4, goes through the polynomials of fdlibm (Sun
Microsystems 1993) in double and of Cephes (Moshier 1992) in single precision.

A primitive of its own, so that its derivatives are itself: exact to all orders.
"""

import jax
import jax.numpy as jnp
from jax import Array
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir
from jax.typing import ArrayLike

# (parts of pi/2, sine, cosine): sin r = r + r^3 S(r^2), cos r = 1 - r^2/2 + r^4 C(r^2)
_DOUBLE = (
    (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21),
    (
        -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04,
        2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10,
    ),
    (
        4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05,
        -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11,
    ),
)  # fmt: skip
_SINGLE = (
    (1.5703125, 4.837512969970703125e-4, 7.54978995489188216e-8),
    (-1.6666654611e-1, 8.3321608736e-3, -1.9515295891e-4),
    (4.166664568298827e-2, -1.388731625493765e-3, 2.443315711809948e-5),
)


def _horner(z: Array, coefficients: tuple) -> Array:
    value = coefficients[-1]
    for c in reversed(coefficients[:-1]):
        value = value * z + c
    return value


def _polynomial(x: Array) -> tuple[Array, Array]:
    parts, sine, cosine = _DOUBLE if x.dtype == jnp.float64 else _SINGLE
    turns = jnp.round(x * (2 / jnp.pi))
    r = ((x - turns * parts[0]) - turns * parts[1]) - turns * parts[2]
    r = jnp.clip(r, -1.0, 1.0)  # idle until x is too large for the parts
    z = r * r
    s = r + r * z * _horner(z, sine)
    c = 1 - 0.5 * z + z * z * _horner(z, cosine)
    quarter = turns - 4 * jnp.floor(0.25 * turns)
    swapped = (quarter == 1) | (quarter == 3)
    a, b = jnp.where(swapped, c, s), jnp.where(swapped, s, c)
    return jnp.where(quarter >= 2, -a, a), jnp.where((quarter == 1) | (quarter == 2), -b, b)


_sin_cos = Primitive("sin_cos")
_sin_cos.multiple_results = True
_sin_cos.def_impl(jax.jit(lambda x: list(_polynomial(x))))
_sin_cos.def_abstract_eval(lambda x: [x, x])
mlir.register_lowering(_sin_cos, mlir.lower_fun(lambda x: list(_polynomial(x)), multiple_results=True))
# other back ends have fast routines of their own
for _platform in ("cuda", "rocm", "tpu"):
    mlir.register_lowering(
        _sin_cos,
        mlir.lower_fun(lambda x: [jnp.sin(x), jnp.cos(x)], multiple_results=True),
        platform=_platform,
    )


def _batch(arguments, axes):
    return _sin_cos.bind(*arguments), axes * 2


def _jvp(primals, tangents):
    (x,), (t,) = primals, tangents
    s, c = _sin_cos.bind(x)
    if isinstance(t, ad.Zero):
        return [s, c], [t, t]
    return [s, c], [c * t, -(s * t)]


batching.primitive_batchers[_sin_cos] = _batch
ad.primitive_jvps[_sin_cos] = _jvp


def sin_cos(x: ArrayLike) -> tuple[Array, Array]:
    """`(sin x, cos x)` of an angle [rad], any shape, of float32 or float64.

    Absolute error at most that of rounding near 1 (2e-16, 1e-7) for `|x|` up to 1e6 in double
    and 1e3 in single precision; beyond, that of the angle itself grows. NaN where x is not finite.
    """
    s, c = _sin_cos.bind(jnp.asarray(x))
    return s, c
