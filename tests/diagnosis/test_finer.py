"""More modes a link, where few of them leave friction something to explain."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from controllers import Replayed, Step
from jaxflex.diagnosis.catalogue import Candidate
from jaxflex.diagnosis.finer import MODES, _widened, finer, is_coarse
from jaxflex.diagnosis.outcome import Outcome
from jaxflex.diagnosis.prepare import HeldOut
from jaxflex.diagnosis.study import Study
from jaxflex.diagnosis.trial import settled_at
from jaxflex.effects import CoulombFriction

FRICTION = Candidate("coulomb_friction", "joint_1", ("torque",))
DRAG = Candidate("quadratic_drag", "joint_1", ("coefficient",))


def recorded(friction, modes=2):
    """File of a link with two modes on a motor, and what was recorded of it with friction and `modes`."""
    motor = jf.DCMotor(1.2, 0.06, 0.06)
    joint = jf.Joint(hub_inertia=1e-4, viscous_friction=2e-4, motor=motor)
    link = jf.Link.from_rectangle(0.4, 0.04, 1.4e-3, 78e9, 2700.0, damping_ratio=0.01)
    arm = jf.Arm((link,), (joint,), drive="voltage")
    times = jnp.linspace(0.0, 2.0, 1001)
    pushes = Replayed(jnp.sin(6.0 * times)[:, None], 0.002)
    true = dataclasses.replace(arm, links=(dataclasses.replace(link, modes=modes),), effects=(friction,))
    run = jf.simulate(true, pushes, Step((0.0,), (0.0,)), times)
    draw = np.random.default_rng(0)
    channels = {"voltage_1": np.asarray(run["voltage_1"])}
    for name, noise in (("angle_1", 1e-4), ("tip_deflection_1", 2e-5)):
        channels[name] = np.asarray(run[name]) + noise * draw.normal(size=len(times))
    return jf.ArmFile(arm, {"default": 0.03}, None), [jf.Recording(np.asarray(times), channels, ())]


def with_links(file, **changes):
    links = tuple(dataclasses.replace(link, **changes) for link in file.arm.links)
    return dataclasses.replace(file, arm=dataclasses.replace(file.arm, links=links))


def studied(file, recordings, effects):
    study = Study(file, recordings, HeldOut.ENDS, lambda line: None)
    search = study.search
    study.outcome = Outcome(search.climb((), search.parameters.start), search.starts(), np.inf)
    study.outcome.final = search.climb(effects, search.parameters.start)
    study.outcome.final_starts = search.starts()
    return study


@pytest.fixture(scope="module")
def sticking():
    """The file of a link, and what was recorded of it with friction, which the file lacks."""
    return recorded(CoulombFriction(0.02, presliding=1e-3))


@pytest.fixture
def settled(sticking):
    """A study of it that has found friction, at nothing."""
    study = Study(*sticking, HeldOut.ENDS, lambda line: None)
    study.outcome = Outcome(*settled_at(study.search, (FRICTION,), study.search.parameters.start), np.inf)
    return study


def test_friction_that_leaves_little_asks_for_more_modes(settled):
    study, file = settled, settled.file

    def asks(level, nominal):
        study.outcome.level, study.outcome.nominal_level = level, nominal
        return is_coarse(study)

    assert asks(1.5, 100.0)
    assert not asks(1.05, 100.0)  # nothing is left
    assert not asks(30.0, 100.0)  # something else is missing
    study.outcome.final = dataclasses.replace(study.outcome.final, effects=(DRAG,))
    assert not asks(1.5, 100.0)
    study.outcome.final = dataclasses.replace(study.outcome.final, effects=(FRICTION,))
    study.file = with_links(file, modes=MODES)
    assert not asks(1.5, 100.0)


@pytest.mark.parametrize("loose", [False, True])
def test_a_start_is_the_same_motion_with_more_modes(sticking, loose):
    """The same readings, rates and currents; further modes are still, and a twist stays the last coordinate."""
    file, recordings = sticking
    if loose:
        joints = tuple(
            dataclasses.replace(own, play=0.01, contact_stiffness=50.0, contact_damping=0.1, motor_share=0.5)
            for own in file.arm.joints
        )
        file = dataclasses.replace(file, arm=dataclasses.replace(file.arm, joints=joints))
    few, more = (
        Study(with_links(file, modes=n), recordings, HeldOut.ENDS, lambda line: None) for n in (2, MODES)
    )
    starts = few.search.starts()
    shift = np.arange(starts[0][0].shape[1]) / 100
    starts = [(kept + shift, slopes) for kept, slopes in starts]
    (wide, _), *_ = _widened(starts, few.search.parameters, more.search.parameters)
    narrow = starts[0][0]
    n, m = (study.search.parameters.arm.assemble().size for study in (few, more))
    assert wide.shape[1] - narrow.shape[1] == 2 * (m - n) == 2 * (MODES - 2)
    np.testing.assert_array_equal(wide[:, 2 * m :], narrow[:, 2 * n :])
    for old, new in ((narrow[:, :n], wide[:, :m]), (narrow[:, n:], wide[:, m:])):
        np.testing.assert_array_equal(new[:, :3], old[:, :3])
        np.testing.assert_array_equal(new[:, 3 : 1 + MODES], 0.0)
        if loose:
            np.testing.assert_array_equal(new[:, m - 1], old[:, n - 1])


@pytest.mark.slow
def test_what_three_modes_made_is_followed_by_three_only():
    """Friction of a plant with three modes, begun from what a search with two made of it."""
    file, recordings = recorded(CoulombFriction(0.03, presliding=5e-4), modes=MODES)
    study = studied(file, recordings, (FRICTION,))
    study.outcome.level, study.outcome.nominal_level = study.search.over_a_second(study.outcome.final), 1e4
    found = finer(study, recordings)
    assert found is not None
    assert found.outcome.level < study.outcome.level
    assert {link.modes for link in found.file.arm.links} == {MODES}
    assert any(f"{MODES} modes" in note for note in found.notes)


def test_more_modes_that_lose_the_motion_are_left(sticking, settled, monkeypatch):
    final = settled.outcome.final

    def lost(search, effects, vector):
        return dataclasses.replace(final, costs={1: np.inf}), search.starts()

    monkeypatch.setattr("jaxflex.diagnosis.finer.settled_at", lost)
    monkeypatch.setattr("jaxflex.diagnosis.finer.find_from", None)
    assert finer(settled, sticking[1]) is None
