"""What makes a hypothesis worth going on with."""

from types import SimpleNamespace

import numpy as np
import pytest

from jaxflex.diagnosis.calibrate import Fit, Freedom
from jaxflex.diagnosis.catalogue import Candidate
from jaxflex.diagnosis.hypothesis import Hypothesis, Search
from jaxflex.diagnosis.normal import Normal

CABLE = Candidate("cable_stiffness", "joint_1", ("stiffness",), (("rest_angle", 0.0),), ("rest_angle",))


class Turned(Search):
    """A joint that was turned from one angle to another."""

    def __init__(self, low, high):
        self.runs = [SimpleNamespace(measured=np.linspace(low, high, 9)[:, None])]
        self.parameters = SimpleNamespace(position=lambda *key: ("stiffness", "rest_angle").index(key[-1]))


@pytest.mark.parametrize(
    "low, high, rest, sensible",
    [(-1.0, 1.0, 3.0, True), (-0.1, 0.1, 3.0, False), (0.0, 0.25, 2.08, False), (100.0, 102.0, 105.0, True)],
)
def test_a_cable_whose_rest_is_far_from_where_its_joint_turns_makes_no_sense(low, high, rest, sensible):
    nothing = Normal(np.eye(0), np.zeros(0), 0.0, 0.0, 100)
    fit = Fit(np.array([0.05, rest]), Freedom.full([]), 0.0, 0.0, nothing)
    assert Turned(low, high).sensible(Hypothesis((CABLE,), fit, 1, {1: 0.0})) == sensible
