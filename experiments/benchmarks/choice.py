"""Which method suits which arm: error of the tip against seconds, for five kinds of loop.

What `simulate` does by default and what `docs/choose.md` says follow from this.
"""

import dataclasses
import time
from typing import Any, NamedTuple

import diffrax
import jax
import jax.numpy as jnp
import numpy as np

import jaxflex as jf
from controllers import PD, Move, Shaped, zvd
from jaxflex.effects import StribeckFriction

from .timing import best_of, compiled

TIMES = jnp.linspace(0.0, 1.0, 51)
ALLOWED = 1e-5  # of the span
PAYLOADS = jnp.linspace(0.0, 0.1, 32)
MOVE = Move((0.0, 0.0), (0.8, 0.5), 0.8)
TORQUES, VOLTAGES = PD((6.0, 2.0), (2.0, 0.6)), PD((30.0, 12.0), (8.0, 3.0))
IMPLICIT = jf.LinearlyImplicit()
LONG = 5.0  # s; what takes longer runs twice


class Case(NamedTuple):
    """An arm without its payload, and what drives it."""

    arm: jf.Arm
    controller: PD
    reference: jf.AbstractReference
    sample_time: float | None = None


def cases() -> dict[str, Case]:
    """One of each kind."""
    slow = jf.ahmad_arm(modes=1, drive="torque")
    windings = jf.ahmad_arm(modes=3)
    # a winding of 0.2 ms beside modes of some milliseconds
    joints = tuple(
        dataclasses.replace(j, motor=dataclasses.replace(j.motor, inductance=jf.scalar(4e-4)))
        for j in windings.joints
    )
    friction = tuple(StribeckFriction(0.05, 0.05, location=f"joint_{i}") for i in (1, 2))
    single = jf.foldager_link(modes=2).linear()
    return {
        "slow": Case(slow, TORQUES, MOVE),
        "stiff": Case(dataclasses.replace(windings, joints=joints), VOLTAGES, MOVE),
        "frictional": Case(
            dataclasses.replace(jf.ahmad_arm(drive="torque"), effects=friction), TORQUES, MOVE
        ),
        "sampled": Case(jf.foldager_link(modes=1), PD((10.0,), (0.3,)), Move((0.0,), (0.5,), 0.8), 1e-3),
        "linear": Case(single, PD((10.0,), (0.3,)), Shaped(Move((0.0,), (0.5,), 0.5), zvd(7.0, 0.01))),
    }


def methods(case: Case, name: str) -> dict[str, list]:
    """Settings of every method that the case allows: a tolerance, which is compiled in, or a step."""

    def adaptive(solver):
        return lambda tol: jf.Adaptive(tol, 1e-2 * tol, solver)

    found: dict[str, list] = {
        "explicit, adaptive": [(adaptive(diffrax.Tsit5()), (tol,), True) for tol in (1e-4, 1e-6)],
        "explicit, fixed": [(jf.Fixed, (2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5), False)],
    }
    if case.sample_time is None:  # several minutes to compile for a batch, sampled more
        found["implicit, adaptive"] = [(adaptive(diffrax.Kvaerno5()), (1e-4,), True)]
        steps = (2e-2, 1e-2, 5e-3, 2e-3, 1e-3, 5e-4)
        found["linearly implicit, fixed"] = [(lambda dt: jf.Fixed(dt, IMPLICIT), steps, False)]
    if name == "linear":
        found["exact"] = [(lambda _: jf.Exact(), (0.0,), True)]
    return found


def tips(case: Case, method: jf.AbstractMethod, payloads: jax.Array) -> jax.Array:
    """Positions of the tip `(arms, times, 2)`."""

    def one(payload):
        run = jf.simulate(
            case.arm.with_payload(payload), case.controller, case.reference, TIMES, method=method,
            sample_time=case.sample_time, channels=["tip_x", "tip_y"],
        )  # fmt: skip
        return run.tip

    return jax.vmap(one)(payloads)


def measure(reduced: bool) -> dict[str, Any]:
    """Rows of error, seconds and seconds of compilation, case by case, and the fastest that is exact enough."""
    payloads = PAYLOADS[:2] if reduced else PAYLOADS
    found: dict[str, Any] = {}
    for name, case in cases().items():
        fine = jf.Fixed(2e-5) if case.sample_time is None else jf.Adaptive(1e-9, 1e-11)
        if name == "frictional":  # near rest explicit steps would have to be shorter still
            fine = jf.Fixed(5e-5, IMPLICIT)
        exact = np.asarray(jax.jit(lambda p, c=case, m=fine: tips(c, m, p))(payloads))
        span = float(sum(link.length for link in case.arm.links))
        rows = []
        for method, settings in methods(case, name).items():
            for make, every, fixed in settings:
                values = every[-1:] if reduced else every
                if fixed:
                    chosen = make(values[0])
                    program, seconds = compiled(lambda p, c=case, m=chosen: tips(c, m, p), payloads)
                    calls = {values[0]: program}
                else:
                    program = jax.jit(lambda p, dt, c=case, make=make: tips(c, make(dt), p))
                    _, seconds = compiled(program, payloads, jnp.asarray(values[0]))
                    calls = {dt: lambda dt=dt, f=program: f(payloads, jnp.asarray(dt)) for dt in values}
                for value, call in calls.items():
                    began = time.perf_counter()
                    error = float(np.max(np.linalg.norm(np.asarray(call()) - exact, axis=-1)))
                    took = time.perf_counter() - began
                    good = bool(np.isfinite(error))
                    best = min(took, best_of(call, 3 if took < LONG else 1))
                    row = {"method": method, "setting": value, "tip error [m]": error if good else None,
                           "seconds": best if good else None, "seconds to compile": seconds}  # fmt: skip
                    rows.append(row)
                    print(name, row, flush=True)
        good = [r for r in rows if r["seconds"] and r["tip error [m]"] <= ALLOWED * span]
        found[name] = {"rows": rows, "fastest": min(good, key=lambda r: r["seconds"], default=None)}
    return found
