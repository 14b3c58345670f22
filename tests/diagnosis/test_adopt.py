import dataclasses

import numpy as np
import pytest

from jaxflex.diagnosis.adopt import adopt, amplitudes_of, held_by, risen, with_candidate, without
from jaxflex.diagnosis.catalogue import Candidate

COULOMB = Candidate("coulomb_friction", "joint_1", ("torque",), (("presliding", 1e-4),), ("presliding",))
CABLE = Candidate("cable_stiffness", "joint_1", ("stiffness",), (("rest_angle", 0.0),), ("rest_angle",))
STRIBECK = Candidate(
    "stribeck_friction", "joint_1", ("torque", "level"), (("stribeck_rate", 0.3), ("presliding", 1e-4)),
    ("stribeck_rate", "presliding"),
)  # fmt: skip


@pytest.mark.parametrize(
    "candidate, step", [(COULOMB, (0.02,)), (CABLE, (0.5, 0.1)), (STRIBECK, (0.01, 0.02))]
)
def test_what_is_adopted_can_be_read_and_taken_out_again(search, candidate, step):
    parameters = search.parameters
    vector = adopt(parameters, parameters.start, candidate, step)
    np.testing.assert_allclose(amplitudes_of(parameters, vector, candidate), step)
    np.testing.assert_array_equal(without(parameters, vector, candidate), parameters.start)


def test_stribecks_law_takes_the_place_of_coulombs_and_keeps_its_level(search):
    parameters = search.parameters
    vector = adopt(parameters, parameters.start, COULOMB, (0.02,))
    vector = adopt(parameters, vector, CABLE, (0.5, 0.0))
    whole, step = risen(parameters, vector, dataclasses.replace(STRIBECK, amplitudes=("torque",)), (0.01,))
    assert whole == STRIBECK and step == (0.01, pytest.approx(0.02))
    effects, vector = with_candidate(parameters, (COULOMB, CABLE), vector, whole, step)
    assert effects == (CABLE, STRIBECK)
    assert vector[parameters.position("coulomb_friction", "joint_1", "torque")] == 0.0
    assert vector[parameters.position("stribeck_friction", "joint_1", "level")] == pytest.approx(0.02)
    assert not held_by(COULOMB) and not held_by(dataclasses.replace(STRIBECK, location="joint_2")) & {
        COULOMB.key
    }
