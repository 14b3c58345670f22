"""How fast the library is: right-hand side, sweeps against C, scaling, gradients, start of a process."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp

import jaxflex as jf
from jaxflex.dynamics.lagrange import accelerations

from .c_code import Compiled
from .choice import measure as choice
from .equations import equations
from .gradients import measure
from .peers import peer_rows
from .pictures import plot_choice, plot_gradients, plot_scaling, plot_sizes, plot_work_precision
from .problem import sweep
from .timing import best_of, compiled, machine
from .work_precision import c_rows, fastest, library_rows, reference, run_library

IMPLICIT = jf.LinearlyImplicit()
BEST = jf.Fixed(0.01, IMPLICIT)


def repeated(models: jf.AssembledArm, count: int, repeats: int) -> tuple[Callable[[], Any], float]:
    """A loop over right-hand sides of `count` arms that moves the state on, and seconds to compile it."""
    start = (jnp.zeros(count),) * models_size(models)

    def library(models, q):
        def one(model, q):
            def move(_, state):
                q, qd = state
                qdd = accelerations(model, q, qd, tuple(1e-3 * jnp.ones_like(x) for x in q))
                qd = tuple(v + 1e-6 * a for v, a in zip(qd, qdd, strict=True))
                return tuple(x + 1e-6 * v for x, v in zip(q, qd, strict=True)), qd

            return jax.lax.fori_loop(0, repeats, move, (q, q))

        return jax.vmap(one)(models, q)

    return compiled(library, models, start)


def rhs(reduced: bool) -> dict[str, Any]:
    """Microseconds of one right-hand side an arm."""
    count, repeats = 64, 500 if reduced else 5000
    models = sweep(count).models()
    call, seconds = repeated(models, count, repeats)
    e = equations(models)
    found = {f"jaxflex, {count} arms": best_of(call), "jaxflex, seconds to compile": seconds}
    with tempfile.TemporaryDirectory() as folder:
        for lanes, name in ((1, "scalar C"), (8, "vector C")):
            program = Compiled(e, lanes, Path(folder))
            found[name] = best_of(lambda p=program: p.repeat(e.parameters, repeats))
    return {k: v if "compile" in k else 1e6 * v / repeats / count for k, v in found.items()}


def models_size(models: jf.AssembledArm) -> int:
    """Coordinates of a batched assembled arm."""
    return len(models.links) + sum(link.shapes for link in models.links)


def work_precision(reduced: bool) -> dict[str, Any]:
    """The sweep of the issue: seconds for an error of the tip of 1e-5 of the span."""
    arms = sweep(16 if reduced else 512)
    e, exact = equations(arms.models()), reference(arms)
    methods: dict[str, jf.AbstractMethod] = {
        f"linearly implicit, {dt:g} s": jf.Fixed(dt, IMPLICIT)
        for dt in ((0.01,) if reduced else (0.02, 0.01, 5e-3, 2.5e-3))
    }
    methods["RK4, 0.001 s"] = jf.Fixed(1e-3)
    with tempfile.TemporaryDirectory() as folder:
        rows = c_rows(arms, e, exact, (1e-3,) if reduced else (1.05e-3, 1e-3, 5e-4), Path(folder))
    rows += library_rows(arms, exact, methods)
    others, missing = peer_rows(arms, e, exact, reduced)
    rows += others
    best = {name: fastest(rows, name) for name in dict.fromkeys(r["program"] for r in rows)}
    ours = best.pop("jaxflex")
    return {
        "arms": len(arms.payloads),
        "rows": rows,
        "not measured": missing,
        "fastest that are exact enough": [ours, *best.values()],
        "seconds over those of jaxflex": {name: r["seconds"] / ours["seconds"] for name, r in best.items()},
    }


def scaling(reduced: bool) -> dict[str, Any]:
    """Microseconds an arm of the sweep against the number of arms."""
    counts = (1, 64) if reduced else (1, 64, 512, 4096, 32768, 100_000)
    found = {}
    for count in counts:
        run = run_library(sweep(count), BEST)
        run()
        found[count] = best_of(run, 3 if count < 10_000 else 1) / count * 1e6
    return {"microseconds an arm": found}


def sizes(reduced: bool) -> dict[str, Any]:
    """A right-hand side of 64 arms, and its compilation, against the number of links and of modes."""
    count, repeats = 64, 50 if reduced else 500
    some = range(1, 3 if reduced else 7)
    cases = [(links, 2) for links in some] + [(2, modes) for modes in some if modes != 2]
    rows = []
    for links, modes in cases:

        def arm(payload, links=links, modes=modes):
            one = jf.ahmad_arm(payload, modes=modes, drive="torque", mode_shapes="clamped_tip_mass")
            joints = (one.joints[0],) + (one.joints[1],) * (links - 1)
            return jf.Arm((one.links[0],) * links, joints, one.payload)

        models = jax.jit(jax.vmap(lambda m, arm=arm: arm(m).assemble()))(jnp.linspace(0.0, 0.1, count))
        call, seconds = repeated(models, count, repeats)
        rows.append(
            {
                "links": links,
                "modes": modes,
                "coordinates": links * (1 + modes),
                "microseconds": best_of(call, 3) / repeats / count * 1e6,
                "seconds to compile": seconds,
            }
        )
        print(rows[-1], flush=True)
    return {"rows": rows}


START = """
import time; began = time.perf_counter()
import jax.numpy as jnp, jaxflex as jf, controllers as ctl
jf.set_up(cache={cache!r})
arm = jf.ahmad_arm(0.05)
jf.simulate(arm, ctl.PD((3.0, 1.0), (1.0, 0.3)), ctl.Move((0.0, 0.0), (0.8, 0.5), 2.0),
            jnp.linspace(0.0, 3.0, 301), method=jf.Fixed())
print(time.perf_counter() - began)
"""


def first_simulation(reduced: bool) -> dict[str, float]:
    """Seconds from the start of a process to the end of its first simulation, import included."""
    del reduced
    with tempfile.TemporaryDirectory() as cache:
        took = [_seconds([sys.executable, "-c", START.format(cache=cache)]) for _ in range(3)]
    return {"cold": took[0], "warm": min(took[1:])}


def tune(reduced: bool) -> dict[str, float]:
    """Seconds of `jaxflex tune` on the built-in arm."""
    steps = ["--steps", "2"] if reduced else []
    with tempfile.TemporaryDirectory() as folder:
        os.environ["JAXFLEX_CACHE"] = f"{folder}/cache"
        command = [sys.executable, "-m", "jaxflex", "tune", *steps, "-o", f"{folder}/results"]
        took = [_seconds(command) for _ in range(2)]
    return {"cold": took[0], "warm": took[1]}


def _seconds(command: list[str]) -> float:
    began = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    return time.perf_counter() - began


def gradients(reduced: bool) -> dict[str, Any]:
    """The gradient of a tuning cost as a multiple of the cost."""
    return {"rows": measure((10,) if reduced else (4, 10, 24, 60, 200))}


QUESTIONS: dict[str, Callable[[bool], dict[str, Any]]] = {
    "rhs": rhs,
    "work_precision": work_precision,
    "scaling": scaling,
    "sizes": sizes,
    "choice": choice,
    "gradients": gradients,
    "first_simulation": first_simulation,
    "tune": tune,
}


def run(folder: Path, reduced: bool, questions: tuple[str, ...] = tuple(QUESTIONS)) -> dict[str, Any]:
    """Answers every question, or those named, and draws what there is to draw."""
    figures: dict[str, Any] = {}
    for name in questions:
        figures[name] = {"machine": machine(), **QUESTIONS[name](reduced)}
        print(name, figures[name], flush=True)
    for name, plot in (
        ("work_precision", plot_work_precision), ("scaling", plot_scaling), ("sizes", plot_sizes),
        ("choice", plot_choice), ("gradients", plot_gradients),
    ):  # fmt: skip
        if name in figures:
            plot(figures[name]).savefig(folder / f"{name}.png", dpi=130)
    return figures
