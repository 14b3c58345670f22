"""Error of the tip against seconds, for the library and for peers that integrate the same arms.

C, numba and SciPy integrate the very equations of the library (`equations`); MuJoCo and
Exudyn model each link as a chain of 20 segments and are compared on seconds at the step
that their own refinement calls converged to the same error.
"""

from collections.abc import Callable
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

import jaxflex as jf
from jaxflex.arm.kinematics import poses

from .c_code import Compiled
from .equations import Equations
from .problem import DURATION, SPAN, Sweep
from .timing import best_of

ALLOWED = 1e-5 * SPAN  # m


def reference(sweep: Sweep) -> np.ndarray:
    """Last tip positions `(arms, 2)` [m] by steps a fifth of the largest stable one."""
    return run_library(sweep, jf.Fixed(2e-4))()


def run_library(sweep: Sweep, method: jf.AbstractMethod) -> Callable[[], np.ndarray]:
    """The sweep by `jf.sweep`; what it returns are the last tip positions."""

    def last(payload):
        run = jf.simulate(
            sweep.arm(payload), sweep.controller, sweep.move, jnp.array([0.0, DURATION]),
            method=method, channels=["tip_x", "tip_y"],
        )  # fmt: skip
        return run.tip[-1]

    return lambda: jf.sweep(last, sweep.payloads)


def tips(sweep: Sweep, states: np.ndarray) -> np.ndarray:
    """Tip positions `(arms, 2)` from last states `(2 n, arms)`."""

    def one(payload, state):
        model = sweep.arm(payload).assemble()
        _, ends = poses(model, tuple(state[: model.size]))
        return jnp.stack([ends[-1].x, ends[-1].y])

    return np.asarray(jax.jit(jax.vmap(one))(jnp.asarray(sweep.payloads), jnp.asarray(states.T)))


def row(name: str, setting: str, found: np.ndarray, exact: np.ndarray, seconds: float) -> dict:
    """One point of the diagram."""
    error = float(np.max(np.linalg.norm(found - exact, axis=1)))
    return {"program": name, "setting": setting, "tip error [m]": error, "seconds": seconds}


def library_rows(sweep: Sweep, exact: np.ndarray, methods: dict[str, jf.AbstractMethod]) -> list[dict]:
    """The library's methods."""
    rows = []
    for setting, method in methods.items():
        run = run_library(sweep, method)
        try:
            found = run()
        except Exception as error:
            raise RuntimeError(f"{setting} failed") from error
        rows.append(row("jaxflex", setting, found, exact, best_of(run)))
    return rows


def c_rows(
    sweep: Sweep, e: Equations, exact: np.ndarray, steps: tuple[float, ...], folder: Path
) -> list[dict]:
    """Scalar and eight-wide C, classical Runge-Kutta."""
    rows = []
    for lanes, name in ((1, "scalar C"), (8, "vector C")):
        program = Compiled(e, lanes, folder)
        for dt in steps:
            found = tips(sweep, program.run(e.parameters, dt))
            seconds = best_of(lambda p=program, h=dt: p.run(e.parameters, h))
            rows.append(row(name, f"RK4, {dt:g} s", found, exact, seconds))
    return rows


def fastest(rows: list[dict], name: str) -> dict:
    """The point of `name` that takes least time of those exact enough."""
    good = [r for r in rows if r["program"] == name and r["tip error [m]"] <= ALLOWED]
    return min(good, key=lambda r: r["seconds"])
