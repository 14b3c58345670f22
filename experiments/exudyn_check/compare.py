"""One motion in both programs, and how far apart they are."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

import controllers as ctl
import jaxflex as jf

from .beams import BeamArm, Motion

STEP = 5e-4  # s, of Exudyn's integration
SAMPLES = 200  # a second


class Pair(NamedTuple):
    """A motion as Exudyn and as jaxflex see it, at the same times."""

    exudyn: Motion
    jaxflex: Motion

    def tip_error(self, length: float | None = None) -> float:
        """Largest distance between the tips as a share of `length` [m], or of the span of Exudyn's path."""
        away = np.linalg.norm(self.jaxflex.tip - self.exudyn.tip, axis=1)
        span = np.linalg.norm(np.ptp(self.exudyn.tip, axis=0)) if length is None else length
        return float(away.max() / span)

    def deflection_share(self, lengths) -> float:
        """Largest tip deflection of a link as a share of its length, after Exudyn."""
        return float(np.max(np.abs(self.exudyn.deflection) / np.asarray(lengths)))


def sine(amplitudes, period: float, cycles: float, end: float) -> ctl.Sampled:
    """`amplitude sin(2 pi t / period)` [N m] for `cycles`, then nothing until `end` [s]."""
    times = np.linspace(0.0, end, round(1000 * end) + 1)
    wave = np.where(times <= cycles * period + 1e-9, np.sin(2 * np.pi * times / period), 0.0)
    return ctl.Sampled(jnp.asarray(times), jnp.asarray(np.outer(wave, amplitudes)), kind="linear")


def jaxflex_motion(arm: jf.Arm, pose, torques: ctl.Sampled) -> Motion:
    """`arm` (driven by torques) from rest at `pose` [rad]."""
    end = float(torques.end())
    times = jnp.linspace(0.0, end, round(SAMPLES * end) + 1)
    links = range(1, len(arm.links) + 1)
    wanted = [f"{kind}_{i}" for kind in ("angle", "tip_deflection") for i in links] + ["tip_x", "tip_y"]
    run = jf.simulate(
        arm,
        ctl.OpenLoop(),
        torques,
        times,
        initial=jf.InitialState(angles=jnp.asarray(pose)),
        channels=wanted,
    )
    angle, deflection = (
        np.stack([np.asarray(run[f"{kind}_{i}"]) for i in links], axis=1) for kind in ("angle", "tip_deflection")
    )
    return Motion(np.asarray(times), angle, deflection, np.asarray(run.tip))


def both(arm: jf.Arm, pose, torques: ctl.Sampled, elements: int, step: float = STEP) -> Pair:
    """`arm` in both programs, from rest at `pose` [rad]; `elements` a link and `step` [s] for Exudyn."""
    ours = jaxflex_motion(arm, pose, torques)
    grid, values = np.asarray(torques.times), np.asarray(torques.values)

    def at(t):
        return np.array([np.interp(t, grid, column) for column in values.T])

    theirs = BeamArm(arm, pose, elements).simulate(at, float(grid[-1]), step, len(ours.times) - 1)
    return Pair(theirs, ours)
