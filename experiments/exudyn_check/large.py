"""Large and fast motion: where a model of small deflections stops being right."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

import controllers as ctl
import jaxflex as jf

from .arms import one_link, two_links
from .compare import Pair, both, jaxflex_motion, sine

HUB = 10.0  # kg m^2, a thousand times the link: what it is told to do, it does
SPIN_UP, TAP, TAIL = 6.0, 8.0, 18.0  # periods of the clamped link: end of the spin-up, the tap, the end


def pace(arm: jf.Arm) -> float:
    """First frequency [Hz] of the arm's links, joints locked."""
    return float(jf.locked_frequencies(arm)[0])


def shaken(amplitudes, elements: int) -> list[Pair]:
    """One link shaken at its own frequency for five periods: it bends far and its hub hardly moves.

    `amplitudes` of the hub's swing [rad].
    """
    arm = one_link(0.0, HUB)
    f = pace(arm)
    scale = (HUB + 0.2 * 0.5**3 / 3) * (2 * np.pi * f) ** 2
    return [both(arm, [0.0], sine((scale * a,), 1 / f, 5, 8 / f), elements) for a in amplitudes]


def pushed(amplitudes, elements: int) -> list[Pair]:
    """Two links with 50 g under one push and brake, `amplitudes` [N m] of the first joint, half of it second."""
    torques = [sine((a, a / 2), 2.0, 1, 3.0) for a in amplitudes]
    return [both(two_links(0.05), [0.0, 0.5], torque, elements) for torque in torques]


class Spin(NamedTuple):
    """A link spun up and tapped, its hub turning at `ratio` of the link's first angular frequency.

    `frequency` of what rings after the tap over that of the link at rest, by model; NaN
    where there is nothing that rings. `traces`: deflection as a share of the length.
    """

    ratio: float
    times: np.ndarray
    frequency: dict[str, float]
    traces: dict[str, np.ndarray]


def spin_torque(rate: float, f: float) -> ctl.Sampled:
    """Torque [N m] that spins the hub up to `rate` [rad/s] smoothly, and later taps it once."""
    end = TAIL / f
    times = np.linspace(0.0, end, round(2000 * end) + 1)
    up = np.where(times < SPIN_UP / f, rate * f / SPIN_UP * (1 - np.cos(2 * np.pi * f * times / SPIN_UP)), 0.0)
    since = times - TAP / f
    tap = np.where((since > 0) & (since < 1 / f), 0.002 * (2 * np.pi * f) ** 2 * np.sin(2 * np.pi * f * since), 0.0)
    inertia = HUB + 0.2 * 0.5**3 / 3
    return ctl.Sampled(jnp.asarray(times), jnp.asarray(inertia * (up + tap))[:, None], kind="linear")


def spun(ratio: float, arms: dict[str, jf.Arm], elements: int) -> Spin:
    """Exudyn and each of `arms` (one link on a heavy hub) at one hub speed."""
    first = next(iter(arms.values()))
    f = pace(first)
    torque = spin_torque(ratio * 2 * np.pi * f, f)
    grid, values = np.asarray(torque.times), np.asarray(torque.values)[:, 0]
    from .beams import BeamArm

    samples = round(100 * TAIL)
    theirs = BeamArm(first, [0.0], elements).simulate(
        lambda t: np.array([np.interp(t, grid, values)]), float(grid[-1]), float(grid[-1]) / (20 * samples) * 10, samples
    )
    traces = {"Exudyn": theirs.deflection[:, 0] / 0.5}
    for name, arm in arms.items():
        try:
            seen = jaxflex_motion(arm, [0.0], torque, samples)
            traces[name] = seen.deflection[:, 0] / 0.5
        except jf.SimulationError as error:
            traces[name] = np.asarray(error.trajectory["tip_deflection_1"]) / 0.5
    frequency = {name: ringing(theirs.times, trace, (TAP + 1) / f) / f for name, trace in traces.items()}
    return Spin(ratio, theirs.times, frequency, traces)


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
