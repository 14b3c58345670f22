"""Dry friction of a flexible link's joint without a simulation: by least squares on its torques, and at rest."""

import numpy as np
from scipy.signal import butter, filtfilt, savgol_filter

import jaxflex as jf

SMOOTHED = 15  # readings of the encoder that give the rate whose sign is taken
AROUND_REST = 0.05  # rad/s over which that sign changes


def motor_torque(arm: jf.Arm, recording: jf.Recording) -> np.ndarray:
    """Torque [N m] of the motor of joint 1 at its load, standing still."""
    motor = arm.joints[0].motor
    per_volt = float(motor.efficiency * motor.gear_ratio * motor.torque_constant / motor.resistance)
    return per_volt * np.asarray(recording["voltage_1"])


def held_torques(
    arm: jf.Arm, recording: jf.Recording, lasting: float, settling: float
) -> tuple[float, float]:
    """The least and the greatest torque [N m] that joint 1 bears without turning.

    What motor and link put on it, a mean over `lasting` [s], with `settling` [s] before and after it, in
    which its encoder moves by one count at most. Dry friction holds as much at least.
    """
    link = arm.links[0]
    stiffness = 3 * float(link.flexural_rigidity / link.length**2)  # N m at the root, per m at the tip
    torque = motor_torque(arm, recording) + stiffness * np.asarray(recording["tip_deflection_1"])
    angle = np.asarray(recording["angle_1"])
    moves = np.abs(np.diff(angle))
    count = moves[moves > 0].min()
    step = float(np.median(np.diff(recording.times)))
    inner, outer = round(lasting / step), round(settling / step)
    windows = np.lib.stride_tricks.sliding_window_view
    held = np.ptp(windows(angle, inner + 2 * outer), 1) < 1.5 * count
    means = windows(torque[outer : len(torque) - outer], inner).mean(1)[held]
    return float(means.min()), float(means.max())


def dry_torque(arm: jf.Arm, recording: jf.Recording, corner: float, slowest: float) -> float:
    """Coulomb torque [N m] at the load of joint 1.

    The motor's torque on acceleration, rate, its sign, deflection (for the link's moment) and an
    offset, all low-passed at `corner` [Hz]; samples of a rate below `slowest` [rad/s] left out.
    """
    step = float(np.median(np.diff(recording.times)))
    numerator, denominator = butter(3, 2 * corner * step)

    def smooth(signal):
        return filtfilt(numerator, denominator, signal)

    angle = np.asarray(recording["angle_1"])
    rate = np.gradient(smooth(angle), step)
    side = np.tanh(np.gradient(savgol_filter(angle, SMOOTHED, 2), step) / AROUND_REST)
    deflection = smooth(np.asarray(recording["tip_deflection_1"]))
    table = np.stack([np.gradient(rate, step), rate, smooth(side), deflection, np.ones_like(rate)], 1)
    torque = smooth(motor_torque(arm, recording))
    moving = np.abs(rate) >= slowest
    return float(np.linalg.lstsq(table[moving], torque[moving])[0][2])
