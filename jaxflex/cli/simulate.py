"""`jaxflex simulate`: one run, as CSV and figure."""

from pathlib import Path

import jax.numpy as jnp
import numpy as np

from controllers import (
    BangBang,
    Design,
    OpenLoop,
    Sampled,
    Step,
    default_move,
    textbook_pd,
    unshaped_design,
)

from ..arm.arm import Arm
from ..arm.library import ahmad_arm
from ..control import AbstractController, AbstractReference
from ..files.arm_file import read_arm_file
from ..files.foreign import FOREIGN
from ..files.read_recording import read_recording
from ..files.tables import write_series
from ..plotting_run import plot
from ..simulation.simulate import InitialState
from ..simulation.simulate import simulate as run
from .design_file import read_design
from .runtime import UsageError, console, make_folder
from .tables import number, write_json

BANG_BANG = {"torque": 0.2, "current": 1.0, "voltage": 2.0}  # N m (Ahmad et al.), A, V


def simulate(
    arm_file: Path | None,
    payload: float | None,
    signal: str | None,
    duration: float | None,
    dt: float,
    json: Path | None,
    output: Path | None,
) -> None:
    """Simulate, draw and write."""
    if not dt > 0:
        raise UsageError(f"--dt {dt:g}: a positive number of seconds is allowed.")
    if duration is not None and not duration > dt:
        raise UsageError(f"--duration {duration:g}: more than --dt, {dt:g} s, is allowed.")
    file = read_arm_file(arm_file) if arm_file else None
    arm = file.arm if file else ahmad_arm()
    design = read_design(file, str(arm_file)) if file else None
    if payload is not None:
        if not payload >= 0:
            raise UsageError(f"--payload {payload:g}: a mass of at least 0 kg is allowed.")
        arm = arm.with_payload(payload)
    controller, reference, start, words = choose(arm, design, signal)
    length = float(duration or 1.5 * float(reference.end()) + 2.0)
    times = jnp.linspace(0.0, length, round(length / dt) + 1)
    console.print(f"[bold]{arm.name}[/], payload {1e3 * float(arm.payload.mass):.0f} g: {words}")
    trajectory = run(arm, controller, reference, times, initial=InitialState(angles=start))
    keep = [n for n in trajectory.channels if not n.startswith("tip_acceleration")]
    channels = {name: np.asarray(trajectory[name]) for name in keep}
    folder = make_folder(output)
    write_series(folder / "run.csv", np.asarray(times), channels)
    plot(trajectory, f"{arm.name}: {words}").savefig(folder / "run.png", dpi=130)
    peaks = {name: float(np.max(np.abs(values))) for name, values in channels.items()}
    for name, value in peaks.items():
        console.print(f"  largest |{name}|  {number(value, 4)} {trajectory.unit(name)}", markup=False)
    console.print(f"{int(trajectory.steps)} steps; wrote {folder / 'run.csv'}, {folder / 'run.png'}")
    if json:
        series = {name: values.tolist() for name, values in channels.items()}
        result = {"times": np.asarray(times).tolist(), "channels": series, "largest": peaks}
        write_json(json, result | {"steps": int(trajectory.steps)})


def choose(
    arm: Arm, design: Design | None, signal: str | None
) -> tuple[AbstractController, AbstractReference, jnp.ndarray, str]:
    """Controller, reference, starting angles and a description of what `--input` asks for."""
    joints = len(arm.joints)
    rest = jnp.zeros(joints)
    if signal is None and design is not None:
        return design.controller, design.reference, jnp.stack(design.move.start), "its design"
    if signal == "bang-bang":
        size = BANG_BANG[arm.drive]
        words = f"bang-bang {arm.drive}, open loop"
        return OpenLoop(), BangBang((size,) * joints), rest, words
    move = design.move if design else default_move(arm)
    controller = design.controller if design else textbook_pd(arm, jnp.stack(move.stop))
    if signal == "step":
        step = Step(move.start, move.stop)
        return controller, step, jnp.stack(move.start), "step of the reference"
    if signal in (None, "move"):
        plain = unshaped_design(controller, move)
        return controller, plain.reference, jnp.stack(move.start), "textbook PD, quintic move"
    return _from_file(arm, controller, signal)


def _from_file(arm: Arm, controller: AbstractController, path: str):
    """The drive's input or the reference in a recording, whichever it holds."""
    if Path(path).suffix.lower() not in (".csv", *FOREIGN):
        allowed = ", ".join(["a CSV file", *FOREIGN])
        raise UsageError(f"--input {path!r}: allowed are move, step, bang-bang or a recording: {allowed}.")
    recording = read_recording(path)
    for repair in recording.repairs:
        console.print(f"{path}: {repair}", markup=False)
    times = jnp.asarray(recording.times - recording.times[0])
    joints = range(1, len(arm.joints) + 1)
    for kind, law in ((arm.drive, OpenLoop()), ("reference", controller)):
        names = [f"{kind}_{i}" for i in joints]
        if all(name in recording.channels for name in names):
            values = jnp.stack([jnp.asarray(recording[name]) for name in names], axis=1)
            shape = "linear" if kind == arm.drive else "cubic"
            start = jnp.zeros(len(names)) if kind == arm.drive else values[0]
            if all(f"angle_{i}" in recording.channels for i in joints):
                start = jnp.stack([jnp.asarray(recording[f"angle_{i}"][0]) for i in joints])
            return law, Sampled(times, values, shape), start, f"{kind} of {path}"
    wanted = ", ".join(f"{arm.drive}_{i}" for i in joints)
    raise UsageError(f"--input {path}: holds neither {wanted} nor reference_1 …; one of them is needed.")
