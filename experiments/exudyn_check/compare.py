"""One motion in both programs, and how far apart they are."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

import controllers as ctl
import jaxflex as jf

from .arms import LENGTH
from .beams import BeamArm, Motion

STEP = 5e-4  # s, of Exudyn's integration
SAMPLES, POINTS = (
    600,
    4000,
)  # of a motion and of its torque: the same for all, so that one program serves them


class Pair(NamedTuple):
    """A motion as Exudyn and as jaxflex see it, at the same times."""

    exudyn: Motion
    jaxflex: Motion

    def tip_error(self, length: float | None = None) -> float:
        """Largest distance between the tips as a share of `length` [m], or of the span of Exudyn's path."""
        away = np.linalg.norm(self.jaxflex.tip - self.exudyn.tip, axis=1)
        span = np.linalg.norm(np.ptp(self.exudyn.tip, axis=0)) if length is None else length
        return float(away.max() / span)

    def deflection_share(self) -> float:
        """Largest tip deflection of a link as a share of its length, after Exudyn."""
        return float(np.max(np.abs(self.exudyn.deflection))) / LENGTH

    def hub_speed(self, frequency: float) -> float:
        """Largest speed of the first joint as a share of an angular frequency, given in Hz."""
        speed = np.gradient(self.exudyn.angle[:, 0], self.exudyn.times)
        return float(np.max(np.abs(speed)) / (2 * np.pi * frequency))


def sine(amplitudes, period: float, cycles: float, end: float) -> ctl.Sampled:
    """`amplitude sin(2 pi t / period)` [N m] for `cycles`, then nothing until `end` [s]."""
    times = np.linspace(0.0, end, POINTS + 1)
    wave = np.where(times <= cycles * period + 1e-9, np.sin(2 * np.pi * times / period), 0.0)
    return ctl.Sampled(jnp.asarray(times), jnp.asarray(np.outer(wave, amplitudes)), kind="linear")


def jaxflex_motion(arm: jf.Arm, pose, torques: ctl.Sampled) -> Motion:
    """`arm` (driven by torques) from rest at `pose` [rad]; NaN if it diverges."""
    end = float(torques.end())
    times = jnp.linspace(0.0, end, SAMPLES + 1)
    links = range(1, len(arm.links) + 1)
    wanted = [f"{kind}_{i}" for kind in ("angle", "tip_deflection") for i in links] + ["tip_x", "tip_y"]
    start = jf.InitialState(angles=jnp.asarray(pose))
    try:
        run = jf.simulate(arm, ctl.OpenLoop(), torques, times, initial=start, channels=wanted)
    except jf.SimulationError as error:
        run = error.trajectory
    angle, deflection = (
        np.stack([np.asarray(run[f"{kind}_{i}"]) for i in links], axis=1)
        for kind in ("angle", "tip_deflection")
    )
    return Motion(np.asarray(times), angle, deflection, np.asarray(run.tip))


def exudyn_motion(arm: jf.Arm, pose, torques: ctl.Sampled, elements: int, step: float = STEP) -> Motion:
    """The same in Exudyn, `elements` a link, integrated in steps of about `step` [s]."""
    grid, values = np.asarray(torques.times), np.asarray(torques.values)
    end = float(grid[-1])

    def at(t):
        return np.array([np.interp(t, grid, column) for column in values.T])

    each = round(end / SAMPLES / step)
    return BeamArm(arm, pose, elements).simulate(at, end, SAMPLES, each)


def both(arm: jf.Arm, pose, torques: ctl.Sampled, elements: int) -> Pair:
    """`arm` in both programs, from rest at `pose` [rad]."""
    return Pair(exudyn_motion(arm, pose, torques, elements), jaxflex_motion(arm, pose, torques))
