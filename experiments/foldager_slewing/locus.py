"""Poles of the driven link against the gains of its PD, and what they do to a move.

The loop is linear about rest, so a move is its exact response to a reference straight
between its samples.
"""

import jax
import jax.numpy as jnp
import numpy as np
import scipy.signal

import controllers as ctl
import jaxflex as jf

from .models import coupled, one_way_tip, rigid

BAND = (10.0, 60.0)  # Hz, where the first elastic mode goes as the gains do
STIFFNESS = 5.0  # V/rad, where the damping gain is swept
DISTANCE, DURATION = 0.5, 0.25  # rad, s, of the move
TIMES = np.linspace(0.0, 1.5, 3001)


def loop(arm: jf.Arm, stiffness: float, damping: float) -> jf.LinearModel:
    """`arm` under a voltage PD, its tip deflection (if it bends) and hub rate out."""
    channels = ("tip_deflection_1", "rate_1")
    return jf.linearise(arm, jnp.zeros(1), ctl.PD((stiffness,), (damping,)), channels)


def poles(stiffness: np.ndarray, damping: np.ndarray) -> np.ndarray:
    """Poles [rad/s] of the coupled model under a voltage PD, gains by rows."""
    arm = coupled("voltage")
    return np.linalg.eigvals(np.stack([loop(arm, k, d).A for k, d in zip(stiffness, damping, strict=True)]))


def vibrating(at: np.ndarray) -> tuple[float, float]:
    """Frequency [Hz] and damping ratio of the least damped pole of `at` that is not real."""
    at = at[at.imag > 0]
    ratio = -at.real / np.abs(at)
    least = np.argmin(ratio)
    return float(np.abs(at[least]) / (2 * np.pi)), float(ratio[least])


def elastic_mode(at: np.ndarray) -> tuple[float, float]:
    """Frequency [Hz] and damping ratio of the least damped pole in `BAND`."""
    frequency = np.abs(at) / (2 * np.pi)
    return vibrating(at[(frequency > BAND[0]) & (frequency < BAND[1])])


def most_damped(dampings: np.ndarray, swept: np.ndarray) -> dict:
    """The damping gain that damps the elastic mode most, from its poles `swept` over `dampings`."""
    modes = [elastic_mode(at) for at in swept]
    best = int(np.argmax([ratio for _, ratio in modes]))
    frequency, ratio = modes[best]
    return {"damping_V_s_rad": float(dampings[best]), "frequency_hz": frequency, "damping_ratio": ratio}


def _reference() -> np.ndarray:
    move = ctl.Move((0.0,), (DISTANCE,), DURATION)

    def at(t):
        setpoint = move.setpoint(t)
        return jnp.stack([setpoint.value[0], setpoint.rate[0], setpoint.acceleration[0]])

    return np.asarray(jax.jit(jax.vmap(at))(jnp.asarray(TIMES)))


def moves(damping: float) -> tuple[np.ndarray, np.ndarray]:
    """Tip deflection [m] over `TIMES` of the move under this damping gain: coupled, and one-way."""

    def outputs(arm):
        linear = loop(arm, STIFFNESS, damping)
        return scipy.signal.lsim(tuple(np.asarray(m) for m in linear[:4]), _reference(), TIMES)[1]

    return outputs(coupled("voltage"))[:, 0], one_way_tip(TIMES, outputs(rigid("voltage"))[:, 1])


def left_ringing(tip: np.ndarray) -> float:
    """Peak-to-peak tip deflection [mm] from a quarter of a second after the move on."""
    return float(1e3 * np.ptp(tip[DURATION + 0.25 < TIMES]))
