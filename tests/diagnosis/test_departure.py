"""What departures of stated parameters are excused for."""

import dataclasses

import numpy as np
import pytest

import jaxflex as jf
from jaxflex.diagnosis.calibrate import Fit, Freedom
from jaxflex.diagnosis.catalogue import Candidate
from jaxflex.diagnosis.departure import MOST_ERROR, is_bent, is_suspect, straightens
from jaxflex.diagnosis.hypothesis import Hypothesis
from jaxflex.diagnosis.normal import Normal
from jaxflex.diagnosis.parameters import Parameters
from jaxflex.files.arm_file import ArmFile

FRICTION = Candidate("coulomb_friction", "joint_1", ("torque",))
CABLE = Candidate("cable_stiffness", "joint_1", ("stiffness",))


@pytest.fixture(scope="module")
def parameters():
    motor = jf.DCMotor(1.2, 0.06, 0.06, inductance=3e-3)
    arm = jf.Arm((), (jf.Joint(hub_inertia=1e-3, viscous_friction=1e-3, motor=motor),), drive="voltage")
    return Parameters(ArmFile(arm, {"default": 0.03}, None), [])


def gone(parameters, departure, *effects):
    """A hypothesis whose parameters all went this far, in standard deviations, and that leaves much."""
    count = len(parameters.nominal)
    normal = Normal(np.eye(count), np.zeros(count), 3e4, 0.0, 10_000)
    found = Fit(np.full(count, float(departure)), Freedom.full([]), 3e4, 0.0, normal)
    return Hypothesis(effects, found, 1, {1: 3e4})


def test_parameters_within_their_uncertainty_speak_of_nothing(parameters):
    assert not is_suspect(parameters, gone(parameters, 1.0))
    assert is_suspect(parameters, gone(parameters, 2.0))


def test_a_large_friction_excuses_some_departure_and_a_cable_none(parameters):
    assert not is_suspect(parameters, gone(parameters, 2.0, FRICTION), explained=1e6)
    assert is_suspect(parameters, gone(parameters, 2.0, FRICTION), explained=1e3)
    assert is_suspect(parameters, gone(parameters, 2.0, CABLE), explained=1e6)


@pytest.mark.parametrize("explained", [1e6, 1e9])
def test_no_friction_excuses_everything(parameters, explained):
    usual = 1.7  # of six parameters
    assert is_suspect(
        parameters, gone(parameters, usual * np.hypot(1, MOST_ERROR) + 0.5, FRICTION), explained
    )


def test_what_is_bent_was_suspect(parameters):
    for departure in np.linspace(0.5, 6, 12):
        if is_bent(parameters, gone(parameters, departure), 0.0):
            assert is_suspect(parameters, gone(parameters, departure))


def test_a_part_that_sets_strained_parameters_straight_is_needed(parameters):
    bent, usual = gone(parameters, 2.0), gone(parameters, 1.0)
    straight = dataclasses.replace(usual, costs={1: 3e4 - 50.0})
    assert straightens(parameters, bent, straight)
    assert not straightens(parameters, usual, straight)
    assert not straightens(parameters, bent, dataclasses.replace(usual, costs={1: 3e4 - 5.0}))
