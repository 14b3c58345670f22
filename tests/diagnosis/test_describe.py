"""What the parameters of an effect may be wrong by, and the force that stands for it."""

import numpy as np
import pytest

from jaxflex.diagnosis.adopt import adopt
from jaxflex.diagnosis.catalogue import Candidate
from jaxflex.diagnosis.describe import _measure, bends_before_it_slides, lacking
from jaxflex.diagnosis.estimates import OWN_ERROR, own_error
from jaxflex.diagnosis.find import find
from jaxflex.diagnosis.foretell import Foretold
from jaxflex.diagnosis.hypothesis import HORIZONS, Hypothesis
from jaxflex.diagnosis.outcome import Outcome
from jaxflex.effects import EFFECTS

RIPPLE = Candidate("cogging_torque", "joint_1", ("sine", "cosine"), (("order", 6.0),))
CABLE = Candidate("cable_stiffness", "joint_1", ("stiffness",), (("rest_angle", 0.0),), ("rest_angle",))


def errors(search, candidate, step):
    vector = adopt(search.parameters, search.parameters.start, candidate, step)
    return {
        part.field: own_error(search.problem, vector, part)
        for part in search.parameters.effect
        if (part.effect, part.location) == candidate.key
    }


def test_a_component_that_is_nothing_is_known_as_well_as_the_whole(search):
    found = errors(search, RIPPLE, (0.0, 0.01))
    assert found["sine"] == found["cosine"] == pytest.approx(OWN_ERROR * 0.01)


def test_no_angle_is_known_better_than_it_is_read(search):
    found = errors(search, CABLE, (0.05, 0.0))
    assert found["stiffness"] == pytest.approx(OWN_ERROR * 0.05)
    assert found["rest_angle"] == pytest.approx(search.problem.setting.noise[0])
    assert found["rest_angle"] > 9e-5


def test_the_force_that_stands_for_a_cable_is_a_line_over_the_angle(swung):
    stiffness = 0.05  # so much that the arm without it cannot be calibrated on what it did
    search = swung(EFFECTS["cable_stiffness"](stiffness, rest_angle=0.0))
    vector = adopt(search.parameters, search.parameters.start, CABLE, (stiffness, 0.0))
    final = Hypothesis((CABLE,), search.settle(vector, HORIZONS[-1]), HORIZONS[-1], {})
    outcome = Outcome(final, search.starts(), np.inf)
    outcome.final, outcome.final_starts = final, search.starts()
    force = next(force for force in lacking(search, outcome) if force.equation == "joint_1")
    slope, offset = np.polyfit(force.angle, force.values, 1)
    assert slope == pytest.approx(-stiffness, rel=0.05)
    assert abs(offset) < 0.05 * np.abs(force.values).max()


@pytest.mark.parametrize("presliding", [2e-3, pytest.param(None, marks=pytest.mark.slow)])
def test_friction_that_bends_is_told_from_friction_that_does_not(swung, presliding):
    search = swung(EFFECTS["coulomb_friction"](0.01, 1e-3, presliding))
    found = find(search).final
    (friction,) = found.effects
    assert friction.effect == "coulomb_friction"
    assert bends_before_it_slides(search.parameters, found.fit.vector, friction) is (presliding is not None)

    def value(field):
        return found.fit.vector[search.parameters.position(*friction.key, field)]

    assert value("torque") == pytest.approx(0.01, rel=0.03)
    if presliding:
        assert value("presliding") == pytest.approx(presliding, rel=0.1)


@pytest.mark.parametrize("span, said", [(1.0, "over 1 s from"), (0.3, "over 1 s (0.3 s after) from")])
def test_what_is_foretold_for_less_long_is_said_to_be(span, said):
    before, after = (Foretold({}, {}, [], [], seconds) for seconds in (1.0, span))
    assert said in _measure(before, after)
