"""How well an arm foretells the torque that a motion took, by its inverse model."""

import jax
import jax.numpy as jnp
import numpy as np
from scipy.signal import butter, decimate, filtfilt

import jaxflex as jf

CORNER = 80.0  # Hz: noise of the encoder above it would drown the acceleration
SLOWER = 20  # readings to one that is compared, as for least squares on an inverse model
ENDS = 10  # of these, at either end, that the filters have bent


def motion(recording: jf.Recording) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angle [rad], rate [rad/s] and acceleration [rad/s^2] of joint 1, smoothed without delay."""
    step = float(np.median(np.diff(recording.times)))
    numerator, denominator = butter(4, 2 * CORNER * step)
    angle = filtfilt(numerator, denominator, np.asarray(recording["angle_1"]))
    rate = np.gradient(angle, step)
    return angle, rate, np.gradient(rate, step)


def foretold(arm: jf.Arm, recording: jf.Recording) -> np.ndarray:
    """Torque [N m] that the motion of a single rigid axis takes, friction and all."""
    model = arm.assemble()

    def torque(time, angle, rate, acceleration):
        (own,) = jf.inverse_dynamics(model, (angle,), (rate,), (acceleration,))
        outside = sum(e(angle, rate, time) for e in arm.effects if isinstance(e, jf.AbstractJointEffect))
        return own - outside

    return np.asarray(jax.vmap(torque)(jnp.asarray(recording.times), *map(jnp.asarray, motion(recording))))


def slower(signal: np.ndarray) -> np.ndarray:
    """A signal low-passed and thinned, its ends left out."""
    return decimate(np.asarray(signal), SLOWER, zero_phase=True)[ENDS:-ENDS]


def force_error(arm: jf.Arm, recording: jf.Recording) -> float:
    """`|tau - tau_model| / |tau|` over a run, both filtered alike."""
    measured = slower(recording["torque_1"])
    return float(np.linalg.norm(measured - slower(foretold(arm, recording))) / np.linalg.norm(measured))


def least_error(recording: jf.Recording) -> float:
    """The same for the best inertia and viscous friction, nothing else in the model."""
    _, rate, acceleration = motion(recording)
    table, measured = np.stack([slower(acceleration), slower(rate)], 1), slower(recording["torque_1"])
    left = measured - table @ np.linalg.lstsq(table, measured)[0]
    return float(np.linalg.norm(left) / np.linalg.norm(measured))
