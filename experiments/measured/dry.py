"""Dry friction of a flexible link's joint by least squares on its torques, filtered alike."""

import numpy as np
from scipy.signal import butter, filtfilt, savgol_filter

import jaxflex as jf

SMOOTHED = 15  # readings of the encoder that give the rate whose sign is taken
AROUND_REST = 0.05  # rad/s over which that sign changes


def dry_torque(arm: jf.Arm, recording: jf.Recording, corner: float, slowest: float) -> float:
    """Coulomb torque [N m] at the load of joint 1.

    The motor's torque on acceleration, rate, its sign, deflection (for the link's moment) and an
    offset, all low-passed at `corner` [Hz]; samples of a rate below `slowest` [rad/s] left out.
    """
    motor = arm.joints[0].motor
    per_volt = float(motor.efficiency * motor.gear_ratio * motor.torque_constant / motor.resistance)
    step = float(np.median(np.diff(recording.times)))
    numerator, denominator = butter(3, 2 * corner * step)

    def smooth(signal):
        return filtfilt(numerator, denominator, signal)

    angle = np.asarray(recording["angle_1"])
    rate = np.gradient(smooth(angle), step)
    side = np.tanh(np.gradient(savgol_filter(angle, SMOOTHED, 2), step) / AROUND_REST)
    deflection = smooth(np.asarray(recording["tip_deflection_1"]))
    table = np.stack([np.gradient(rate, step), rate, smooth(side), deflection, np.ones_like(rate)], 1)
    torque = per_volt * smooth(np.asarray(recording["voltage_1"]))
    moving = np.abs(rate) >= slowest
    return float(np.linalg.lstsq(table[moving], torque[moving])[0][2])
