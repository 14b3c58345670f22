"""Which experiment tells two effects apart."""

import numpy as np
import pytest

from jaxflex.diagnosis.adopt import adopt, amplitudes_of
from jaxflex.diagnosis.catalogue import Candidate
from jaxflex.diagnosis.hypothesis import Hypothesis
from jaxflex.diagnosis.next_experiment import MENU, separations

CABLE = Candidate("cable_stiffness", "joint_1", ("stiffness",))
OFFSET = Candidate("load_torque_bias", "joint_1", ("torque",))


@pytest.mark.parametrize("candidate, step", [(CABLE, (2e-3, 1e-3)), (OFFSET, (1e-3,))])
def test_what_is_adopted_has_the_amplitudes_of_its_step(search, candidate, step):
    vector = adopt(search.parameters, search.parameters.start, candidate, step)
    np.testing.assert_allclose(amplitudes_of(search.parameters, vector, candidate), step)


def test_a_cable_is_told_from_an_offset_the_better_the_stiffer_and_the_farther_it_turns(search):
    found = []
    for stiffness in (1e-5, 2e-5):
        vector = adopt(search.parameters, search.parameters.start, CABLE, (stiffness, 0.0))
        final = Hypothesis((CABLE,), search.settle(vector), 1, {})
        found.append(separations(search, final, CABLE, OFFSET))
    assert found[0].keys() == MENU.keys()
    for name in MENU:
        assert found[1][name] == pytest.approx(4 * found[0][name], rel=0.1), name
    # twice the voltage turns twice as far
    again, twice = (found[0][name] for name in list(MENU)[:2])
    assert twice == pytest.approx(4 * again, rel=0.1)
