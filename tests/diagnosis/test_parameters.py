"""What is known of the arm before anything is fitted."""

import pytest

from jaxflex.diagnosis.parameters import Parameters
from jaxflex.files.arm_file import ArmFile

from .test_shooting import nominal


def test_a_link_gives_way_at_its_root_as_a_beam_does():
    arm = nominal()
    link = arm.links[0]
    beam = float(link.length / (3 * link.flexural_rigidity))
    assert Parameters(ArmFile(arm, {"default": 0.03}, None), []).gives_way(0) == pytest.approx(beam, rel=0.03)
