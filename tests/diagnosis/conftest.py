"""A small problem to search."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from controllers import Replayed, Step
from jaxflex.diagnosis.hypothesis import Search
from jaxflex.diagnosis.prepare import make_problem


@pytest.fixture(scope="session")
def swung(recorded):
    """Gives the search in recordings of a bare axis that swings to and fro, with effects that its file lacks."""

    def searched(*effects, duration=2.0):
        file, recordings = recorded(*effects, duration=duration)
        found = make_problem(file, recordings)
        return Search(found.problem, found.calibration, print)

    return searched


@pytest.fixture(scope="session")
def recorded():
    """Gives the file of the axis, and what was recorded of it [s] with effects that the file lacks."""

    def record(*effects, duration=2.0):
        motor = jf.DCMotor(1.2, 0.06, 0.06)
        joint = jf.Joint(hub_inertia=2e-3, viscous_friction=1e-3, motor=motor)
        arm = jf.Arm((), (joint,), drive="voltage")
        times = jnp.linspace(0.0, duration, round(500 * duration) + 1)
        pushes = Replayed(jnp.sin(4.0 * times)[:, None], 0.002)
        true = dataclasses.replace(arm, effects=effects)
        run = jf.simulate(true, pushes, Step((0.0,), (0.0,)), times)
        noise = 1e-4 * np.random.default_rng(0).normal(size=len(times))
        channels = {"voltage_1": np.asarray(run["voltage_1"]), "angle_1": np.asarray(run["angle_1"]) + noise}
        recording = jf.Recording(np.asarray(times), channels, ())
        return jf.ArmFile(arm, {"default": 0.03}, None), [recording]

    return record


@pytest.fixture(scope="module")
def search(swung):
    """A bare axis that swings to and fro for two seconds."""
    return swung()
