"""C of the benchmark's sweep: right-hand side, classical Runge-Kutta steps, threads of none.

The expressions are those of `equations`, with common subexpressions taken out by sympy;
products of parameters alone are worked out once an arm, before the loop. `real` is a double,
or a vector of eight of gcc's vector extensions, one arm a lane.
"""

import ctypes
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import sympy as sp
from sympy.printing.c import C99CodePrinter

from .equations import Equations
from .problem import DURATION, GAINS, MOVE_TIME, STOP

HEAD = """
#include <math.h>
#ifdef LANES
typedef double real __attribute__((vector_size(8 * LANES)));
typedef long mask __attribute__((vector_size(8 * LANES)));
#else
#define LANES 1
typedef double real;
#endif
#define N %(n)d
#define P %(parameters)d
#define H %(constants)d

#if LANES > 1
#define CHOOSE(m, a, b) ((real)(((m) & (mask)(a)) | (~(m) & (mask)(b))))
/* fdlibm's kernels after reduction by multiples of pi/2, as in jaxflex/trigonometry.py */
static inline void sin_cos(real x, real *s, real *c) {
    const double big = 6755399441055744.0;
    real turns = (x * 0.63661977236758134308 + big) - big;
    real r = ((x - turns * 1.57079632673412561417e+00) - turns * 6.07710050630396597660e-11)
             - turns * 2.02226624879595063154e-21;
    real z = r * r;
    real a = r + r * z * (-1.66666666666666324348e-01 + z * (8.33333333332248946124e-03
        + z * (-1.98412698298579493134e-04 + z * (2.75573137070700676789e-06
        + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))));
    real b = 1.0 - 0.5 * z + z * z * (4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03
        + z * (2.48015872894767294178e-05 + z * (-2.75573143513906633035e-07
        + z * (2.08757232129817482790e-09 - z * 1.13596475577881948265e-11)))));
    real q = turns * 0.25;
    q = turns - 4.0 * ((q - 0.375 + big) - big); /* turns modulo 4 */
    mask odd = (q == 1.0) | (q == 3.0);
    real p = CHOOSE(odd, b, a), o = CHOOSE(odd, a, b);
    mask down = q >= 2.0, left = (q == 1.0) | (q == 2.0);
    *s = CHOOSE(down, -p, p);
    *c = CHOOSE(left, -o, o);
}
#else
static inline void sin_cos(real x, real *s, real *c) { *s = sin(x); *c = cos(x); }
#endif

static void constants(const real *p, real *h) {
%(once)s
}

static inline void slope(double t, const real *p, const real *h, const real *y, real *d) {
    const real *q = y, *v = y + N;
    double x = t / %(move)r; x = x < 0 ? 0 : x > 1 ? 1 : x;
    double share = x * x * x * (10 + x * (6 * x - 15)), rate = 30 * x * x * (1 - x) * (1 - x) / %(move)r;
    real f[N];
    for (int i = 0; i < N; i++) f[i] = 0 * y[0];
%(command)s
    real ss, cc;
    sin_cos(%(angle)s, &ss, &cc);
%(body)s
    /* M = L D L^T */
    for (int i = 0; i < N; i++) {
        for (int j = 0; j < i; j++) {
            for (int k = 0; k < j; k++) m[i][j] -= m[i][k] * l[j][k];
            l[i][j] = m[i][j] * inv[j];
        }
        for (int k = 0; k < i; k++) m[i][i] -= l[i][k] * m[i][k];
        inv[i] = 1.0 / m[i][i];
    }
    for (int i = 0; i < N; i++) for (int k = 0; k < i; k++) f[i] -= l[i][k] * f[k];
    for (int i = 0; i < N; i++) f[i] *= inv[i];
    for (int i = N - 1; i >= 0; i--) for (int k = i + 1; k < N; k++) f[i] -= l[k][i] * f[k];
    for (int i = 0; i < N; i++) { d[i] = v[i]; d[N + i] = f[i]; }
}

/* `arms` a multiple of LANES, parameters [P][arms]; last states to out [2 N][arms] */
void run(int arms, int steps, double dt, const double *given, double *out) {
    for (int a = 0; a < arms; a += LANES) {
        real p[P], h[H], y[2 * N], z[2 * N], d[2 * N], total[2 * N];
        for (int i = 0; i < P; i++) p[i] = *(const real *)(given + (long)i * arms + a);
        constants(p, h);
        for (int i = 0; i < 2 * N; i++) y[i] = 0 * p[0];
        for (int s = 0; s < steps; s++) {
            double t = s * dt;
            slope(t, p, h, y, d);
            for (int i = 0; i < 2 * N; i++) { total[i] = d[i]; z[i] = y[i] + 0.5 * dt * d[i]; }
            slope(t + 0.5 * dt, p, h, z, d);
            for (int i = 0; i < 2 * N; i++) { total[i] += 2.0 * d[i]; z[i] = y[i] + 0.5 * dt * d[i]; }
            slope(t + 0.5 * dt, p, h, z, d);
            for (int i = 0; i < 2 * N; i++) { total[i] += 2.0 * d[i]; z[i] = y[i] + dt * d[i]; }
            slope(t + dt, p, h, z, d);
            for (int i = 0; i < 2 * N; i++) y[i] += dt / 6.0 * (total[i] + d[i]);
        }
        for (int i = 0; i < 2 * N; i++) *(real *)(out + (long)i * arms + a) = y[i];
    }
}

/* the right-hand side alone, `count` times over, each at a state a little further on */
void repeat(int arms, int count, const double *given, double *out) {
    for (int a = 0; a < arms; a += LANES) {
        real p[P], h[H], y[2 * N], d[2 * N];
        for (int i = 0; i < P; i++) p[i] = *(const real *)(given + (long)i * arms + a);
        constants(p, h);
        for (int i = 0; i < 2 * N; i++) y[i] = 0 * p[0];
        for (int s = 0; s < count; s++) {
            slope(1.0, p, h, y, d);
            for (int i = 0; i < N; i++) { y[N + i] += 1e-6 * d[N + i]; y[i] += 1e-6 * y[N + i]; }
        }
        for (int i = 0; i < 2 * N; i++) *(real *)(out + (long)i * arms + a) = y[i];
    }
}
"""


class _Printer(C99CodePrinter):
    def _print_Pow(self, expr):
        base, power = expr.as_base_exp()
        if power.is_Integer and 1 < int(power) < 4:
            return "(" + "*".join([f"({self._print(base)})"] * int(power)) + ")"
        return super()._print_Pow(expr)


def _split(expressions: list[sp.Expr], q: list, qd: list):
    """Polynomials in state, sine and cosine, their coefficients named as constants of an arm."""
    state = [sp.Symbol("cc"), sp.Symbol("ss"), *q, *qd]
    once: dict[sp.Expr, sp.Symbol] = {}
    replaced = []
    for expression in expressions:
        terms = []
        for powers, coefficient in sp.Poly(sp.expand(expression), *state).terms():
            monomial = sp.Mul(*(x**n for x, n in zip(state, powers, strict=True)))
            named = coefficient
            if not coefficient.is_number:
                key = coefficient if (-coefficient) not in once else -coefficient
                sign = 1 if key is coefficient else -1
                named = sign * once.setdefault(key, sp.Symbol(f"h[{len(once)}]"))
            terms.append((named, monomial))
        replaced.append(sp.horner(sum(c * m for c, m in terms), wrt=state) if terms else sp.Integer(0))
    return replaced, once


class Operations(NamedTuple):
    """What a right-hand side computes, statement by statement, pairs of a name and an expression.

    `once` an arm, the constants `h[k]` last; `shared` for each state, then the lower triangle
    `mass[i, j]` and the bias with its damping `bias[i]`; `angle` is what `ss` and `cc` are of.
    """

    once: list[tuple[sp.Symbol, sp.Expr]]
    shared: list[tuple[sp.Symbol, sp.Expr]]
    mass: dict[tuple[int, int], sp.Expr]
    bias: list[sp.Expr]
    angle: sp.Expr
    constants: int


def operations(e: Equations) -> Operations:
    """The equations over `p[i]`, `q[i]` and `v[i]`, common subexpressions taken out."""
    n = len(e.q)
    angle = next(iter(e.mass.atoms(sp.sin, sp.cos))).args[0]
    short = {sp.cos(angle): sp.Symbol("cc"), sp.sin(angle): sp.Symbol("ss")}
    below = [(i, j) for i in range(n) for j in range(i + 1)]
    lower = [e.mass[i, j].subs(short) for i, j in below]
    right = [x.subs(short) + d * v for x, d, v in zip(e.bias, e.damping, e.qd, strict=True)]
    renamed = {s: sp.Symbol(f"p[{i}]") for i, s in enumerate(e.symbols)}
    renamed |= {s: sp.Symbol(f"q[{i}]") for i, s in enumerate(e.q)}
    renamed |= {s: sp.Symbol(f"v[{i}]") for i, s in enumerate(e.qd)}
    named = [sp.Symbol(f"q[{i}]") for i in range(n)], [sp.Symbol(f"v[{i}]") for i in range(n)]
    polynomials, once = _split([x.xreplace(renamed) for x in (*lower, *right)], *named)
    shared, out = sp.cse(polynomials, optimizations="basic")
    once_shared, once_out = sp.cse(list(once))
    first = [*once_shared, *zip(once.values(), once_out, strict=True)]
    mass = dict(zip(below, out[: len(below)], strict=True))
    return Operations(first, shared, mass, out[len(below) :], angle.xreplace(renamed), max(1, len(once)))


def joint_feedback(end: str = "") -> list[str]:
    """The PD law, a line a joint, in C (with `end=";"`) or Python."""
    return [
        f"    f[{i}] = {float(GAINS.stiffness[i])!r} * ({STOP[i]!r} * share - q[{i}])"
        f" + {float(GAINS.damping[i])!r} * ({STOP[i]!r} * rate - v[{i}]){end}"
        for i in range(len(STOP))
    ]


def source(e: Equations) -> str:
    """The C program."""
    found, printed = operations(e), _Printer().doprint
    first = [
        f"    {s} = {printed(x)} + 0 * p[0];" if "[" in s.name else f"    real {s} = {printed(x)};"
        for s, x in found.once
    ]
    body = [f"    real {s} = {printed(x)};" for s, x in found.shared]
    body.append("    real m[N][N], l[N][N], inv[N];")
    body += [f"    m[{i}][{j}] = {printed(x)} + 0 * y[0];" for (i, j), x in found.mass.items()]
    body += [f"    f[{i}] -= {printed(x)};" for i, x in enumerate(found.bias)]
    command = joint_feedback(";")
    return HEAD % {
        "n": len(e.q), "parameters": len(e.symbols), "constants": found.constants,
        "once": "\n".join(first), "move": MOVE_TIME, "command": "\n".join(command),
        "angle": printed(found.angle), "body": "\n".join(body),
    }  # fmt: skip


class Compiled:
    """The program compiled by `gcc -O3 -march=native`, `lanes` arms abreast (1: scalar code)."""

    def __init__(self, e: Equations, lanes: int, folder: Path):
        self.lanes, self.size = lanes, len(e.q)
        code, library = folder / "sweep.c", folder / f"sweep{lanes}.so"
        code.write_text(source(e))
        wide = [f"-DLANES={lanes}", "-mprefer-vector-width=512"] if lanes > 1 else []
        flags = ["-O3", "-march=native", "-ffast-math", "-fno-associative-math", "-shared", "-fPIC"]
        subprocess.run(["gcc", *flags, *wide, code, "-o", library, "-lm"], check=True)
        self.library = ctypes.CDLL(str(library))

    def _call(self, function: Callable, parameters: np.ndarray, *arguments) -> np.ndarray:
        count = len(parameters)
        padded = -(-count // self.lanes) * self.lanes
        given = _aligned((parameters.shape[1], padded))
        given[:, :count] = parameters.T
        given[:, count:] = given[:, count - 1 : count]
        out = _aligned((2 * self.size, padded))
        pointer = ctypes.POINTER(ctypes.c_double)
        function(padded, *arguments, given.ctypes.data_as(pointer), out.ctypes.data_as(pointer))
        return out[:, :count]

    def run(self, parameters: np.ndarray, dt: float) -> np.ndarray:
        """Last states `(2 n, arms)` after `DURATION`, by steps of `dt` or a little less."""
        steps = int(np.ceil(DURATION / dt - 1e-9))
        return self._call(self.library.run, parameters, steps, ctypes.c_double(DURATION / steps))

    def repeat(self, parameters: np.ndarray, count: int) -> np.ndarray:
        """`count` right-hand sides an arm."""
        return self._call(self.library.repeat, parameters, count)


def _aligned(shape: tuple[int, int]) -> np.ndarray:
    memory = np.zeros(shape[0] * shape[1] * 8 + 64, np.uint8)
    begin = -memory.ctypes.data % 64
    return memory[begin : begin + shape[0] * shape[1] * 8].view(float).reshape(shape)
