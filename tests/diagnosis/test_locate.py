"""The force that the model lacks, and what it goes with."""

import numpy as np
import pytest

from jaxflex.diagnosis.locate import latent_forces, regimes
from jaxflex.effects import CoulombFriction


def force(search, horizon):
    return latent_forces(search.problem, search.runs[0], search.parameters.start, horizon)[0]


def test_friction_is_a_torque_that_goes_with_the_direction_of_motion(swung):
    found = force(swung(CoulombFriction(0.01, presliding=1e-4)), 1)
    picture, share = regimes(found)[0]
    assert found.equation in ("joint_1", "voltage_1")  # no current is measured that would tell these apart
    assert picture == "the direction of motion (speed reversals)"
    assert share > 0.8


@pytest.mark.parametrize("lost", [slice(2, 4), slice(None)])
def test_of_a_motion_that_is_lost_there_is_none(swung, lost):
    search = swung(CoulombFriction(0.01, presliding=1e-4))
    search.runs[0].starts[lost, :2] = 1e200
    found = force(search, 10)
    for part in (found.values, found.angle, found.rate, found.acceleration):
        assert np.isfinite(part).all()
    assert all(np.isfinite(share) for _, share in regimes(found))
