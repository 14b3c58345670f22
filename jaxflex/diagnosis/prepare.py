"""From an arm file and recordings to a problem: channels, noise, pieces, and where each starts."""

# arrays of numpy go to JAX and come back, which its annotations do not foresee
# pyright: reportArgumentType=false, reportOptionalMemberAccess=false, reportOptionalOperand=false

import dataclasses
import enum
from collections.abc import Sequence

import numpy as np
from scipy.signal import savgol_filter

from ..arm.arm import Arm
from ..arm.parts import AbstractLink, Link
from ..drive import has_current_state
from ..files.arm_file import ArmFile
from ..files.prepare import prepare
from ..files.recording import Recording, RecordingError
from .catalogue import template
from .noise import noise_floors
from .parameters import Parameters
from .plant import bristles, heats, hidden_loads, state_size, substeps_for
from .runs import Run
from .shooting import Problem, Setting

OUTPUTS = ("angle", "rate", "current", "tip_deflection", "strain", "tip_acceleration")
LEAST_MODES = 2  # of a link that bends
PIECE = 0.1  # s: the shortest horizon
SHORTEST_PIECE = 10  # samples
FAST_WINDING = 0.25  # of a sample: a winding faster than this follows at once
SMALLEST_NOISE = 2e-4  # of a channel's spread: no model is better than that
SAMPLES = 25_000  # of one recording that are used
COLD = 1e-3  # J: no winding's heat is known better
UNSEEN = 1e-6  # spread of what no reading tells: it stays as it is put
SLOW = 0.02  # of a joint's typical rate: below it, which way a bristle is bent is a guess
CALIBRATION = 0.6  # of a recording that is divided; the rest is held out


class HeldOut(enum.Enum):
    """What a diagnosis does not search but is judged by."""

    RUNS = "the later recordings"
    ENDS = "the ends of all recordings"
    BEGINNINGS = "the beginnings of all recordings"


@dataclasses.dataclass(frozen=True)
class Prepared:
    """A problem with its runs for calibration and those held out, and what was done to get there."""

    problem: Problem
    calibration: list[Run]
    held_out: list[Run]
    floor: dict[str, float]
    notes: tuple[str, ...]


def wanted_channels(arm: Arm) -> tuple[list[str], list[str]]:
    """Names of the inputs, one a joint, and of all outputs that a recording of this arm may hold."""
    inputs = [f"{arm.drive}_{i + 1}" for i in range(len(arm.joints))]
    outputs = []
    for i, joint in enumerate(arm.joints, 1):
        outputs += [f"angle_{i}", f"rate_{i}"]
        if joint.motor is not None and arm.drive == "voltage":
            outputs.append(f"current_{i}")
    for i, link in enumerate(arm.links, 1):
        if link.modes > 0:
            outputs.append(f"tip_deflection_{i}")
            if link.thickness is not None:
                outputs.append(f"strain_{i}")
        outputs.append(f"tip_acceleration_{i}")
    return inputs, outputs


def without_fast_windings(arm: Arm, sample_time: float) -> tuple[Arm, list[str]]:
    """The arm with the current of windings much faster than a sample following at once."""
    joints, notes = [], []
    for i, joint in enumerate(arm.joints, 1):
        joints.append(joint)
        motor = joint.motor
        if motor is not None and motor.inductance is not None:
            constant = float(motor.inductance / motor.resistance)
            if constant < FAST_WINDING * sample_time:
                joints[-1] = dataclasses.replace(joint, motor=dataclasses.replace(motor, inductance=None))
                notes.append(
                    f"joint {i}: the winding (L/R = {1e3 * constant:.2g} ms) is taken to follow at once"
                )
    return dataclasses.replace(arm, joints=tuple(joints)), notes


def bends_by_fewer(link: AbstractLink, modes: int) -> bool:
    """True of an elastic link of assumed modes that has fewer than so many."""
    return isinstance(link, Link) and link.model == "assumed_modes" and 0 < link.modes < modes


def with_modes(arm: Arm, modes: int) -> Arm:
    """The arm with so many modes at least in every such link."""
    links = (
        dataclasses.replace(link, modes=modes) if bends_by_fewer(link, modes) else link for link in arm.links
    )
    return dataclasses.replace(arm, links=tuple(links))


def make_problem(
    file: ArmFile,
    recordings: Sequence[Recording],
    held_out: HeldOut = HeldOut.RUNS,
    carried: bool = False,
) -> Prepared:
    """Check the recordings, find their noise, cut them into pieces.

    `held_out`: what a diagnosis is judged by; of a single recording its end, where whole runs are asked for.
    `carried`: loads that no reading shows go on from piece to piece, and begin none where it suits them.

    **Raises** `RecordingError` if an input or every output is missing, or too little is left.
    """
    inputs, known = wanted_channels(file.arm)
    # all recordings are brought to the slowest of their rates
    step = max(recording.sample_time for recording in recordings)
    even = [prepare(r, inputs, known, sample_time=step, samples=SAMPLES) for r in recordings]
    pieces = [piece for group in even for piece in group]
    outputs = tuple(name for name in known if all(name in piece.channels for piece in pieces))
    if not outputs:
        found = "; ".join(", ".join(piece.channels) for piece in pieces)
        raise RecordingError(f"the recordings share no output; they hold {found}.")
    notes = [note for piece in pieces for note in piece.repairs]
    arm, more = without_fast_windings(file.arm, step)
    notes += more
    if any(bends_by_fewer(link, LEAST_MODES) for link in arm.links):
        # what one mode leaves out would be taken for something missing
        arm = with_modes(arm, LEAST_MODES)
        notes.append("links with one mode are given a second one")
    file = dataclasses.replace(file, arm=arm)
    floors = noise_floors(pieces, inputs, outputs)
    noise = []
    for name in outputs:
        spread = float(np.mean([np.std(piece[name]) for piece in pieces]))
        noise.append(max(floors[name].innovation, SMALLEST_NOISE * spread))
    colour = [np.array([1.0, *(-a for a in floors[name].ar)]) for name in outputs]
    length = max(round(PIECE / step), SHORTEST_PIECE)
    effects = template(arm, outputs, _typical_rates(arm, pieces, step))
    substeps = substeps_for(dataclasses.replace(arm, effects=()).assemble(), step)
    parameters = Parameters(file, effects)
    model = parameters.arm.assemble()
    spread = np.full(state_size(model, outputs), 1e3)
    spread[bristles(model)] = UNSEEN
    hidden = hidden_loads(model) if carried else []
    spread[hidden] = UNSEEN
    setting = Setting(parameters, outputs, np.array(noise), colour, step, length, substeps, spread, hidden)
    if len(pieces) > 1 and held_out is HeldOut.RUNS:
        runs = [make_run(piece, inputs, setting) for piece in pieces]
        count = (len(runs) + 1) // 2
        first, second = runs[:count], runs[count:]
    else:
        share = 1 - CALIBRATION if held_out is HeldOut.BEGINNINGS else CALIBRATION
        parts = [(piece, max(int(share * len(piece) / length), 1) * length) for piece in pieces]
        first = [make_run(piece.window(0, cut), inputs, setting) for piece, cut in parts]
        second = [
            make_run(piece.window(cut, len(piece)), inputs, setting, cut * step)
            for piece, cut in parts
            if cut < len(piece)
        ]
    calibration, judged_by = (second, first) if held_out is HeldOut.BEGINNINGS else (first, second)
    warmest = np.max([run.starts[:, heats(model)].max(0) for run in (*first, *second)], 0)
    spread[heats(model)] = np.maximum(warmest, COLD)
    return Prepared(
        Problem(dataclasses.replace(setting, start_spread=spread)), calibration, judged_by,
        {name: floors[name].std for name in outputs}, tuple(dict.fromkeys(notes)),
    )  # fmt: skip


def make_run(recording: Recording, inputs: Sequence[str], setting: Setting, begin: float = 0.0) -> Run:
    """A recording cut into pieces, its starts guessed; `begin` [s] since the start of the run."""
    dt, length = setting.sample_time, setting.length
    times = begin + np.arange(len(recording)) * dt
    command = np.stack([recording[channel] for channel in inputs], -1)
    reading = np.stack([recording[channel] for channel in setting.channels], -1)
    pieces = -(-len(times) // length)
    total = pieces * length
    padded = np.pad(reading, ((0, total - len(times)), (0, 0)), mode="edge").reshape(pieces, length, -1)
    valid = (np.arange(total) < len(times)).reshape(pieces, length)
    starts = first_starts(setting, times, reading, command)
    return Run(times, command, padded, valid, starts, starts.copy(), np.arange(pieces))


def _typical_rates(arm: Arm, pieces: Sequence[Recording], dt: float) -> list[float]:
    """What each joint typically turns at [rad/s]."""
    found = []
    for i in range(1, len(arm.joints) + 1):
        rates = [1.0]
        for piece in pieces:
            if f"rate_{i}" in piece.channels:
                rates.append(float(np.std(piece[f"rate_{i}"])))
            elif f"angle_{i}" in piece.channels:
                window = max(1, round(0.02 / dt))
                angle = piece[f"angle_{i}"]
                rates.append(float(np.std((angle[window:] - angle[:-window]) / (window * dt))))
        found.append(float(np.mean(rates[1:] or rates)))
    return found


def first_starts(setting: Setting, times: np.ndarray, reading: np.ndarray, command: np.ndarray) -> np.ndarray:
    """A state for the start of each piece, from smoothed readings alone."""
    arm, channels = setting.parameters.arm, setting.channels
    length, dt = setting.length, setting.sample_time
    model = arm.assemble()
    count = -(-len(times) // length)
    at = np.minimum(np.arange(count) * length, len(times) - 1)
    window = max(5, int(0.03 / dt) | 1)
    found = {name: reading[:, i] for i, name in enumerate(channels)}

    def smooth(values, order):
        if len(values) <= window:
            return values if order == 0 else np.gradient(values, dt)
        return savgol_filter(values, window, 3, deriv=order, delta=dt)

    n, joints = model.size, len(arm.joints)
    q, qd = np.zeros((count, n)), np.zeros((count, n))
    for i in range(joints):
        angle, rate = found.get(f"angle_{i + 1}"), found.get(f"rate_{i + 1}")
        if angle is not None:
            q[:, i], qd[:, i] = smooth(angle, 0)[at], smooth(angle, 1)[at]
        if rate is not None:
            qd[:, i] = smooth(rate, 0)[at]
        if angle is None and rate is not None:
            q[:, i] = (np.cumsum(rate) * dt)[at]
    place = joints
    for i, link in enumerate(model.links):
        bent = found.get(f"tip_deflection_{i + 1}")
        strain = found.get(f"strain_{i + 1}")
        if link.shapes:
            if bent is not None:
                shape = float((link.shown or link.tip_deflection)[0])
                q[:, place], qd[:, place] = smooth(bent, 0)[at] / shape, smooth(bent, 1)[at] / shape
            elif strain is not None:
                shape = float(arm.links[i].thickness / 2 * link.gauge_curvature[0])
                q[:, place], qd[:, place] = smooth(strain, 0)[at] / shape, smooth(strain, 1)[at] / shape
        place += link.shapes
    parts = [q, qd]
    heat = np.zeros((count, joints))
    for i, joint in enumerate(arm.joints):
        if joint.motor is None or arm.drive != "voltage":
            continue
        current = found.get(f"current_{i + 1}")
        if current is not None:
            current = smooth(current, 0)[at]
        else:
            emf = float(joint.motor.back_emf_constant * joint.motor.gear_ratio) * qd[:, i]
            current = (command[at, i] - emf) / float(joint.motor.resistance)
        if has_current_state(model, i):
            parts.append(current[:, None])
        power = np.asarray(joint.motor.resistance * current**2)
        heat[1:, i] = np.cumsum(power[:-1]) * length * dt
    parts.append(heat)
    typical = np.sqrt(np.mean(qd[:, :joints] ** 2, 0)) + 1e-300
    parts.append(np.tanh(qd[:, :joints] / (SLOW * typical)))
    parts.append(reading[at])
    return np.concatenate(parts, 1)
