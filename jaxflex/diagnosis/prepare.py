"""From an arm file and recordings to a problem: channels, noise, pieces, and where each starts."""

import math

import jax
import jax.numpy as jnp
import numpy as np
from scipy.signal import savgol_filter

from ..arm.arm import Arm
from ..drive import has_current_state
from ..files.arm_file import ArmFile
from ..files.recording import Recording, RecordingError
from ..simulation.trajectory import Trajectory
from .parameters import Parameters
from .plant import derivative, state_size
from .shooting import Run, Setting

OUTPUTS = ("angle", "rate", "current", "tip_deflection", "strain", "tip_acceleration")
PIECE = 0.1  # s: the shortest horizon
LIMIT = 1.2  # of |lambda| h of a Runge-Kutta substep


def channels_of(file: ArmFile, recording: Recording) -> tuple[list[str], list[str]]:
    """Inputs, one a joint, and outputs that a recording holds for this arm.

    **Raises** `RecordingError` if an input or every output is missing.
    """
    arm = file.arm
    inputs = [f"{arm.drive}_{i + 1}" for i in range(len(arm.joints))]
    for name in inputs:
        if name not in recording.channels:
            raise RecordingError(
                f"column {name!r} is missing: the arm is driven by {arm.drive}, so each joint's "
                f"{arm.drive} is needed; found {', '.join(recording.channels)}."
            )
    outputs = []
    for name in recording.channels:
        kind, _, number = name.rpartition("_")
        if kind not in OUTPUTS or name in inputs or not number.isdigit():
            continue
        parts = arm.links if kind in ("tip_deflection", "strain", "tip_acceleration") else arm.joints
        there = int(number) <= len(parts)
        if kind == "current" and there:
            there = arm.joints[int(number) - 1].motor is not None
        if kind == "strain" and there:
            there = arm.links[int(number) - 1].thickness is not None
        if there:
            outputs.append(name)
    if not outputs:
        raise RecordingError(
            f"no output of this arm was recorded; at least one of {', '.join(OUTPUTS)} (with the number "
            f"of the joint or link) is needed; found {', '.join(recording.channels)}."
        )
    return inputs, outputs


def substeps_for(arm: Arm, sample_time: float) -> int:
    """Runge-Kutta steps in a sample interval that resolve the fastest motion of the arm at rest."""
    model = arm.assemble()
    x = jnp.zeros(state_size(model, ()))
    command, force = jnp.zeros(len(arm.joints)), jnp.zeros(model.size)
    zero = jnp.zeros(())
    jacobian = jax.jacfwd(lambda x: derivative(model, zero, x, command, force))(x)
    fastest = float(np.abs(np.linalg.eigvals(np.asarray(jacobian))).max())
    return max(1, math.ceil(fastest * sample_time / LIMIT))


def first_starts(
    parameters: Parameters, channels: tuple[str, ...], times: np.ndarray, reading: np.ndarray,
    command: np.ndarray, length: int, dt: float,
) -> np.ndarray:  # fmt: skip
    """A state for the start of each piece, from smoothed readings alone."""
    arm = parameters.arm
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
                shape = float(link.tip_deflection[0])
                q[:, place], qd[:, place] = smooth(bent, 0)[at] / shape, smooth(bent, 1)[at] / shape
            elif strain is not None:
                shape = float(arm.links[i].thickness / 2 * link.gauge_curvature[0])
                q[:, place], qd[:, place] = smooth(strain, 0)[at] / shape, smooth(strain, 1)[at] / shape
        place += link.shapes
    parts = [q, qd]
    for i in range(joints):
        if has_current_state(model, i):
            current = found.get(f"current_{i + 1}")
            if current is None:
                motor = arm.joints[i].motor
                emf = float(motor.back_emf_constant * motor.gear_ratio) * qd[:, i]
                current = (command[at, i] - emf) / float(motor.resistance)
            else:
                current = smooth(current, 0)[at]
            parts.append(current[:, None])
    parts.append(np.zeros((count, joints)))
    parts.append(reading[at])
    return np.concatenate(parts, 1)
