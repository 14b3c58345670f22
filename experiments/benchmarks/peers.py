"""The sweep in other programs: numba and SciPy with the library's equations, MuJoCo, Exudyn and SoRoMoX with their own.

Each returns rows of the work-precision diagram. MuJoCo models each link as a chain of 20
segments, Exudyn by eight geometrically exact beams, SoRoMoX (`soromox_model`) by a rod of variable
curvature: their arm is not quite the same one, so their error is against their own converged
result. A few arms are run and the seconds scaled to all.
"""

import importlib.util
from collections.abc import Callable
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp
from sympy.printing.pycode import PythonCodePrinter

import jaxflex as jf

from .c_code import joint_feedback, operations
from .equations import Equations
from .problem import DURATION, GAINS, MOVE_TIME, STOP, Sweep
from .timing import best_of
from .work_precision import row, tips

SEGMENTS, BEAMS = 20, 8
CURVATURES = 2  # polynomials of a link's curvature in SoRoMoX: as many coordinates as the library has
FEW = 4  # arms run by programs that take seconds for each

NUMBA = """
import math
from numba import njit

@njit(fastmath=True, inline="always")
def solve(m, f, n):
    for i in range(n):
        for j in range(i):
            for k in range(j):
                m[i, j] -= m[i, k] * m[k, j]
            m[j, i] = m[i, j] / m[j, j]
        for k in range(i):
            m[i, i] -= m[k, i] * m[i, k]
    for i in range(n):
        for k in range(i):
            f[i] -= m[k, i] * f[k]
    for i in range(n):
        f[i] /= m[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            f[i] -= m[i, k] * f[k]

@njit(fastmath=True)
def constants(p, h):
{once}

@njit(fastmath=True, inline="always")
def slope(t, p, h, y, d, m):
    q, v, f = y[:{n}], y[{n}:], d[{n}:]
    x = min(max(t / {move!r}, 0.0), 1.0)
    share = x * x * x * (10 + x * (6 * x - 15))
    rate = 30 * x * x * (1 - x) * (1 - x) / {move!r}
    for i in range({n}):
        f[i] = 0.0
{command}
    ss, cc = math.sin({angle}), math.cos({angle})
{body}
    solve(m, f, {n})
    for i in range({n}):
        d[i] = v[i]

@njit(fastmath=True)
def run(given, steps, dt, out):
    h, m = np.empty({constants}), np.empty(({n}, {n}))
    y, z, d, total = np.empty({n2}), np.empty({n2}), np.empty({n2}), np.empty({n2})
    for a in range(given.shape[0]):
        p = given[a]
        constants(p, h)
        y[:] = 0.0
        for s in range(steps):
            t = s * dt
            slope(t, p, h, y, d, m)
            for i in range({n2}):
                total[i] = d[i]
                z[i] = y[i] + 0.5 * dt * d[i]
            for half in range(2):
                slope(t + 0.5 * dt, p, h, z, d, m)
                ahead = 0.5 * dt if half == 0 else dt
                for i in range({n2}):
                    total[i] += 2 * d[i]
                    z[i] = y[i] + ahead * d[i]
            slope(t + dt, p, h, z, d, m)
            for i in range({n2}):
                y[i] += dt / 6 * (total[i] + d[i])
        out[:, a] = y

@njit(fastmath=True)
def derivative(t, y, p, h, m):
    d = np.empty({n2})
    slope(t, p, h, y, d, m)
    return d
"""


def compiled_python(e: Equations) -> dict[str, Any]:
    """The equations as functions compiled by numba."""
    found, printed = operations(e), PythonCodePrinter({"fully_qualified_modules": False}).doprint
    body = [f"{s} = {printed(x)}" for s, x in found.shared]
    body += [f"m[{i}, {j}] = {printed(x)}" for (i, j), x in found.mass.items()]
    body += [f"f[{i}] -= {printed(x)}" for i, x in enumerate(found.bias)]
    command = joint_feedback()
    text = NUMBA.format(
        n=len(e.q), n2=2 * len(e.q), constants=found.constants, move=MOVE_TIME,
        angle=printed(found.angle), command="\n".join(command),
        once="\n".join(f"    {s} = {printed(x)}" for s, x in found.once),
        body="\n".join(f"    {line}" for line in body),
    )  # fmt: skip
    made: dict[str, Any] = {"np": np, "count": found.constants}
    exec(compile(text, "numba sweep", "exec"), made)
    return made


def numba_rows(sweep: Sweep, e: Equations, exact: np.ndarray, steps: tuple[float, ...]) -> list[dict]:
    """Classical Runge-Kutta over scalars, compiled by numba with fast mathematics."""
    program, rows = compiled_python(e), []
    out = np.empty((2 * len(e.q), len(e.parameters)))
    for dt in steps:
        count = int(np.ceil(DURATION / dt - 1e-9))

        def run(count=count):
            program["run"](e.parameters, count, DURATION / count, out)

        run()
        rows.append(row("numba", f"RK4, {dt:g} s", tips(sweep, out), exact, best_of(run)))
    return rows


def scipy_rows(sweep: Sweep, e: Equations, exact: np.ndarray, few: int) -> list[dict]:
    """`solve_ivp` arm by arm, its right-hand side compiled by numba."""
    program, rows = compiled_python(e), []
    n, arms = len(e.q), np.linspace(0, len(e.parameters) - 1, few).astype(int)
    some, m = Sweep(sweep.payloads[arms], sweep.controller, sweep.move), np.empty((n, n))
    constants = []
    for a in arms:
        h = np.empty(program["count"])
        program["constants"](e.parameters[a], h)
        constants.append((e.parameters[a], h))

    def solve(method: str, tolerance: float) -> np.ndarray:
        ends = []
        for p, h in constants:
            found = solve_ivp(
                lambda t, y, p=p, h=h: program["derivative"](t, y, p, h, m), (0.0, DURATION), np.zeros(2 * n),
                method=method, rtol=tolerance, atol=1e-2 * tolerance,
            )  # fmt: skip
            ends.append(found.y[:, -1])
        return np.stack(ends, axis=1)

    for method in ("RK45", "DOP853", "LSODA", "Radau", "BDF"):
        for tolerance in (1e-4, 1e-6):
            found = solve(method, tolerance)
            seconds = best_of(lambda s=method, t=tolerance: solve(s, t), 2)
            scaled = seconds * len(e.parameters) / few
            rows.append(row("SciPy", f"{method}, {tolerance:g}", tips(some, found), exact[arms], scaled))
    return rows


def mujoco_model(arm: jf.Arm):
    """The arm in MuJoCo: links as chains of `SEGMENTS` rigid pieces on hinges with springs."""
    import mujoco  # noqa: PLC0415

    lines, closing, inner = [], "", ""
    for i, link in enumerate(arm.links):
        piece = float(link.length) / SEGMENTS
        mass = float(link.mass_per_length) * piece
        spring = float(link.flexural_rigidity) / piece
        joint = arm.joints[i]
        for k in range(SEGMENTS):
            lines.append(f'<body pos="{0.0 if i == k == 0 else piece} 0 0">')
            if k == 0:
                lines.append(f'<joint name="j{i}" axis="0 0 1" armature="0"/>')
                hub = f'<inertial pos="0 0 0" mass="{max(float(joint.hub_mass), 1e-9)}" '
                turning = float(joint.hub_inertia)
                hub += f'diaginertia="{turning} {turning} {turning}"/>'
                lines.append(f"<body>{hub}</body>")
            else:
                lines.append(f'<joint axis="0 0 1" stiffness="{spring}" damping="{1e-5 * spring}"/>')
            turning = mass * piece**2 / 12
            lines.append(
                f'<inertial pos="{piece / 2} 0 0" mass="{mass}" diaginertia="{turning} {turning} {turning}"/>'
            )
            closing += "</body>"
    lines.append(
        f'<body pos="{piece} 0 0"><inertial pos="0 0 0" mass="{max(float(arm.payload.mass), 1e-9)}" '
        'diaginertia="1e-9 1e-9 1e-9"/><site name="tip"/></body>'
    )
    for i in range(len(arm.links)):
        p, d = float(GAINS.stiffness[i]), float(GAINS.damping[i])
        inner += f'<general joint="j{i}" gainprm="{p}" biastype="affine" biasprm="0 {-p} {-d}"/>'
    return mujoco.MjModel.from_xml_string(
        '<mujoco><option gravity="0 0 0"><flag contact="disable"/></option>'
        f"<compiler boundmass='0' boundinertia='0' inertiafromgeom='false' balanceinertia='true'/><worldbody>"
        f"{''.join(lines)}{closing}</worldbody><actuator>{inner}</actuator></mujoco>"
    )


def mujoco_rows(sweep: Sweep, few: int) -> list[dict]:
    """`mujoco.rollout` on one thread, the step halved until the tip changes no more."""
    import mujoco  # noqa: PLC0415
    from mujoco import rollout  # noqa: PLC0415

    arms = np.linspace(0, len(sweep.payloads) - 1, few).astype(int)
    models = [mujoco_model(sweep.arm(m)) for m in sweep.payloads[arms]]

    def run(dt: float) -> np.ndarray:
        count = round(DURATION / dt)
        t = (np.arange(count) + 0.5) * dt
        x = np.clip(t / MOVE_TIME, 0, 1)
        share = x**3 * (10 + x * (6 * x - 15))
        rate = 30 * x**2 * (1 - x) ** 2 / MOVE_TIME
        held = [s * (share + float(GAINS.damping[i] / GAINS.stiffness[i]) * rate) for i, s in enumerate(STOP)]
        for model in models:
            model.opt.timestep = dt
            model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        control = np.broadcast_to(np.stack(held, axis=1), (few, count, len(STOP)))
        starts = np.zeros((few, mujoco.mj_stateSize(models[0], mujoco.mjtState.mjSTATE_FULLPHYSICS)))
        data = mujoco.MjData(models[0])
        states, _ = rollout.rollout(models, data, starts, np.ascontiguousarray(control), nstep=count)
        ends = []
        for model, state in zip(models, states[:, -1], strict=True):
            mujoco.mj_setState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
            mujoco.mj_forward(model, data)
            ends.append(data.site("tip").xpos[:2].copy())
        return np.array(ends)

    # the motor of the second joint turns the last segment of the first link, which weighs next to
    # nothing: its damping leaves all but the implicit integrators at steps of microseconds
    rows, scale = [], len(sweep.payloads) / few
    exact = run(1e-5)
    for dt in (8e-5, 4e-5, 2e-5):
        found = run(dt)
        rows.append(
            row("MuJoCo", f"implicitfast, {dt:g} s", found, exact, best_of(lambda d=dt: run(d), 1) * scale)
        )
    return rows


def exudyn_rows(sweep: Sweep, few: int) -> list[dict]:
    """Generalised-alpha steps with a modified Newton method; torques are those of the library's run."""
    from ..exudyn_check.beams import BeamArm  # noqa: PLC0415

    arms = np.linspace(0, len(sweep.payloads) - 1, few).astype(int)
    grid = jnp.linspace(0.0, DURATION, 2001)
    torques = []
    for mass in sweep.payloads[arms]:
        run = jf.simulate(sweep.arm(mass), sweep.controller, sweep.move, grid, method=jf.Fixed(5e-4))
        torques.append(np.stack([run["torque_1"], run["torque_2"]], axis=1))

    def run(steps: int) -> np.ndarray:
        ends = []
        for mass, torque in zip(sweep.payloads[arms], torques, strict=True):
            beams = BeamArm(sweep.arm(mass), (0.0, 0.0), BEAMS)

            def at(t, u=torque):
                place = min(t / DURATION * 2000, 1999.999)
                return u[int(place)] + (place - int(place)) * (u[int(place) + 1] - u[int(place)])

            ends.append(beams.simulate(at, DURATION, 1, steps).tip[-1])
        return np.array(ends)

    rows, scale, exact = [], len(sweep.payloads) / few, run(8000)
    for steps in (500, 1000, 2000):
        found = run(steps)
        seconds = best_of(lambda n=steps: run(n), 1) * scale
        rows.append(row("Exudyn", f"generalised alpha, {DURATION / steps:g} s", found, exact, seconds))
    return rows


def soromox_model(arm: jf.Arm):
    """The arm in SoRoMoX: geometrically exact rods whose curvature is a polynomial, on revolute joints.

    Hubs and payload are rigid stubs of a millimetre; a hub on the first axis needs some mass, which does not move.
    """
    from soromox.systems.components import JointSpec, LinkSpec  # noqa: PLC0415
    from soromox.systems.gvs import GVS, GVSSegment, StrainBasisSpec  # noqa: PLC0415

    straight, stub, thin = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0], 1e-3, 1e-3
    turning, fixed = JointSpec("revolute", "z"), JointSpec("fixed")

    def body(joint, mass, inertia):
        across = np.sqrt(12 * max(inertia / mass - stub**2 / 12, 1e-8))
        piece = LinkSpec.rectangular(
            length=stub, height=across, width=mass / stub / across, density=1.0, reference_strain=straight,
            young_modulus=1.0, poisson_ratio=0.0,
        )  # fmt: skip
        return GVSSegment(piece, joint, StrainBasisSpec("legendre", [0] * 6, 0), 5)

    segments = []
    for joint, link in zip(arm.joints, arm.links, strict=True):
        segments.append(body(turning, float(joint.hub_mass) or 0.1, float(joint.hub_inertia)))
        rod = LinkSpec.rectangular(
            length=float(link.length), height=thin, width=thin, density=float(link.mass_per_length) / thin**2,
            reference_strain=straight, young_modulus=float(link.flexural_rigidity) * 12 / thin**4,
            poisson_ratio=0.0,
        )  # fmt: skip
        segments.append(GVSSegment(rod, fixed, StrainBasisSpec("legendre", ("kappa_z",), CURVATURES - 1), 5))
    segments.append(body(fixed, float(arm.payload.mass), 0.0))
    return GVS.from_segments(segments, gravity=jnp.zeros(3))


def soromox_rows(sweep: Sweep, few: int) -> list[dict]:
    """A batch of arms by `vmap` under `jit`, with diffrax's steps, fixed and adaptive."""
    from soromox.systems.system_state import SystemState  # noqa: PLC0415

    arms = np.linspace(0, len(sweep.payloads) - 1, few).astype(int)
    payloads, middle = jnp.asarray(sweep.payloads[arms]), 0.05
    model = soromox_model(sweep.arm(middle))
    density, size = model.params.link.density, model.num_coordinates
    joints = (0, 1 + CURVATURES)  # the joint angles among the coordinates
    stiffness, damping, stop = (np.zeros(size) for _ in range(3))
    for place, p, d, angle in zip(joints, GAINS.stiffness, GAINS.damping, STOP, strict=True):
        stiffness[place], damping[place], stop[place] = float(p), float(d), angle

    def command(state):
        x = jnp.clip(state.t / MOVE_TIME, 0, 1)
        share, rate = x**3 * (10 + x * (6 * x - 15)), 30 * x**2 * (1 - x) ** 2 / MOVE_TIME
        q, v = state.y[:size], state.y[size:]
        return stiffness * (stop * share - q) + damping * (stop * rate - v), None

    def last(payload, **steps):
        robot = model.update_link_params(density=density.at[-1].multiply(payload / middle))
        start = SystemState(t=jnp.zeros(()), y=jnp.zeros(2 * size))
        found = robot.rollout_closed_loop_to(
            start, command, t1=DURATION, save_ts=jnp.array([DURATION]), max_steps=100_000, **steps
        )
        return robot.forward_kinematics_tips(found.y[-1, :size])[-1, 1:3, 3]

    def ends(**steps):
        program = jax.jit(jax.vmap(lambda payload: last(payload, **steps)))
        return lambda: np.asarray(program(payloads))

    def tolerance(tol):
        return diffrax.PIDController(rtol=tol, atol=1e-2 * tol)

    tsit = diffrax.Tsit5()  # Dopri8 takes half as long again
    settings = {
        "Tsit5, 0.001 s": {"solver": tsit, "solver_dt": 1e-3},
        "Tsit5, 0.001": {"solver": tsit, "solver_dt": 1e-3, "stepsize_controller": tolerance(1e-3)},
        "Tsit5, 0.0001": {"solver": tsit, "solver_dt": 1e-3, "stepsize_controller": tolerance(1e-4)},
    }
    rows, scale, exact = [], len(sweep.payloads) / few, ends(solver=tsit, solver_dt=5e-4)()
    for setting, steps in settings.items():
        run = ends(**steps)
        rows.append(row("SoRoMoX", setting, run(), exact, best_of(run, 2) * scale))
    return rows


def peer_rows(sweep: Sweep, e: Equations, exact: np.ndarray, reduced: bool) -> tuple[list[dict], list[str]]:
    """Rows of every peer that is installed, and a word on each that is not."""
    few = 1 if reduced else FEW
    peers: dict[str, Callable[[], list[dict]]] = {
        "numba": lambda: numba_rows(sweep, e, exact, (1e-3,)) + scipy_rows(sweep, e, exact, few),
        "mujoco": lambda: mujoco_rows(sweep, few),
        "exudyn": lambda: exudyn_rows(sweep, few),
        "soromox": lambda: soromox_rows(sweep, few),
    }
    rows, missing = [], []
    for name, measure in peers.items():
        if importlib.util.find_spec(name) is None:
            missing.append(f"{name} is not installed here and was skipped")
        else:
            rows += measure()
    return rows, missing
