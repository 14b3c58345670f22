"""Large and fast motion: where a model of small deflections stops being right."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

import controllers as ctl
import jaxflex as jf

from .arms import LENGTH, LINK_INERTIA, one_link, stiffened, two_links
from .compare import POINTS, Pair, both, exudyn_motion, jaxflex_motion, sine

EXUDYN, PLAIN, STIFF = "Exudyn", "jaxflex", "jaxflex with centrifugal stiffening"
HUB = 10.0  # kg m^2, a thousand times the link: what it is told to do, it does
INERTIA = HUB + LINK_INERTIA
SPIN_UP, TAP, TAIL = 6.0, 8.0, 18.0  # periods of the clamped link: end of the spin-up, the tap, the end


def pace(arm: jf.Arm) -> float:
    """First frequency [Hz] of the arm's links, joints locked."""
    return float(jf.locked_frequencies(arm)[0])


def shaken(swings, elements: int) -> list[dict[str, Pair]]:
    """One link shaken at its own frequency for five periods: it bends far and its hub hardly turns.

    `swings` [rad]: amplitudes of the hub.
    """
    arm = one_link(0.0, HUB)
    f = pace(arm)
    torques = [sine((INERTIA * a * (2 * np.pi * f) ** 2,), 1 / f, 5, 8 / f) for a in swings]
    return [_pairs(arm, [0.0], torque, elements) for torque in torques]


def pushed(amplitudes, elements: int) -> list[dict[str, Pair]]:
    """Two links with 50 g under one push and brake: `amplitudes` [N m] at the first joint, half at the second."""
    torques = [sine((a, a / 2), 2.0, 1, 3.0) for a in amplitudes]
    return [_pairs(two_links(0.05), [0.0, 0.5], torque, elements) for torque in torques]


def _pairs(arm, pose, torques, elements) -> dict[str, Pair]:
    plain = both(arm, pose, torques, elements)
    return {PLAIN: plain, STIFF: Pair(plain.exudyn, jaxflex_motion(stiffened(arm), pose, torques))}


class Spin(NamedTuple):
    """A link spun up and tapped, its hub turning at `ratio` of the link's first angular frequency.

    `at_rest` [Hz] is that frequency; `frequency`, by model, of what rings after the tap over
    it, NaN where nothing does. `traces`: deflection as a share of the length.
    """

    ratio: float
    at_rest: float
    times: np.ndarray
    frequency: dict[str, float]
    traces: dict[str, np.ndarray]


def spin_torque(rate: float, f: float) -> ctl.Sampled:
    """Torque [N m] that spins the hub up to `rate` [rad/s] smoothly, and later taps it once."""
    end = TAIL / f
    times = np.linspace(0.0, end, POINTS + 1)
    up = np.where(
        times < SPIN_UP / f, rate * f / SPIN_UP * (1 - np.cos(2 * np.pi * f * times / SPIN_UP)), 0.0
    )
    since = times - TAP / f
    tap = np.where(
        (since > 0) & (since < 1 / f), 0.002 * (2 * np.pi * f) ** 2 * np.sin(2 * np.pi * f * since), 0.0
    )
    return ctl.Sampled(jnp.asarray(times), jnp.asarray(INERTIA * (up + tap))[:, None], kind="linear")


def spun(ratio: float, elements: int) -> Spin:
    """A link on a heavy hub at one hub speed: Exudyn, and jaxflex without and with stiffening."""
    plain = one_link(0.0, HUB)
    f = pace(plain)
    torques = spin_torque(ratio * 2 * np.pi * f, f)
    motions = {
        EXUDYN: exudyn_motion(plain, [0.0], torques, elements),
        PLAIN: jaxflex_motion(plain, [0.0], torques),
        STIFF: jaxflex_motion(stiffened(plain), [0.0], torques),
    }
    traces = {name: motion.deflection[:, 0] / LENGTH for name, motion in motions.items()}
    times = motions[EXUDYN].times
    frequency = {name: ringing(times, trace, (TAP + 1) / f) / f for name, trace in traces.items()}
    return Spin(ratio, f, times, frequency, traces)


def ringing(times, signal, start: float) -> float:
    """Frequency [Hz] of `signal` from `start` [s] on, from its upward passages through its mean; NaN below two."""
    after = times >= start
    t, y = times[after], signal[after]
    if not np.all(np.isfinite(y)):
        return float("nan")
    y = y - (y.max() + y.min()) / 2
    up = np.flatnonzero((y[:-1] < 0) & (y[1:] >= 0))
    if len(up) < 2:
        return float("nan")
    instants = t[up] - y[up] * (t[up + 1] - t[up]) / (y[up + 1] - y[up])
    return float((len(up) - 1) / (instants[-1] - instants[0]))
