"""How candidates are fitted beside what was found before them."""

import dataclasses

import numpy as np
import pytest

from jaxflex.diagnosis.catalogue import Candidate
from jaxflex.diagnosis.find import FURTHER, _short_list, confirmed_from, settled_at, sift
from jaxflex.diagnosis.hypothesis import CLOSE, HORIZONS, Ranked, Search
from jaxflex.effects import StribeckFriction, ViscousFriction

SHAPE = (("stribeck_rate", 0.3), ("presliding", 1e-4))
STRIBECK = Candidate(
    "stribeck_friction", "joint_1", ("torque", "level"), SHAPE, ("stribeck_rate", "presliding")
)
COULOMB = Candidate("coulomb_friction", "joint_1", ("torque",), (("presliding", 1e-4),), ("presliding",))
DRAG = Candidate("quadratic_drag", "joint_1", ("coefficient",))


class Misled(Search):
    """Finds nothing from parameters that were bent."""

    def confirm(self, base, starts, ranked, to, *args, **options):
        found = super().confirm(base, starts, ranked, to, *args, **options)
        straight = not base.fit.vector[: len(self.parameters.nominal)].any()
        return found if straight else dataclasses.replace(found, costs={1: 1e9})


def test_what_takes_the_place_of_another_is_fitted_from_the_stated_parameters_too(swung):
    search = swung(StribeckFriction(0.01, 0.01, 0.5, presliding=1e-4))
    search = Misled(search.problem, search.runs, print)
    nominal = search.climb((), search.parameters.start, to=1)
    before = Search.confirm(search, nominal, search.starts(), Ranked(COULOMB, (0.01,), 0.0, 0.0), 1)
    assert before.fit.level > CLOSE
    rises = Ranked(STRIBECK, (0.01, 0.01), 0.0, 0.0)
    found, found_starts = confirmed_from(search, before, search.starts(), rises, 1)
    assert found.effects == (STRIBECK,)
    assert found.fit.level < CLOSE
    place = search.parameters.position(*STRIBECK.key, "level")
    assert found.fit.vector[place] == pytest.approx(0.01, rel=0.2)
    assert np.array_equal(found_starts[0][0], search.runs[0].starts)
    # what takes nothing's place goes on from where the parameters are
    drag, _ = confirmed_from(search, before, search.starts(), Ranked(DRAG, (1e-4,), 0.0, 0.0), 1)
    assert drag.costs == {1: 1e9}


def test_what_stands_out_at_one_horizon_does_not_hide_what_does_at_another():
    """A slow instrument explains most over a second, damping most over a tenth of one."""
    items = [
        Ranked(candidate, (1.0,), gain, strength, horizon)
        for candidate, gain, strength, horizon in [
            (COULOMB, 6e3, 160.0, 1),
            (STRIBECK, 2e3, 60.0, 1),
            (DRAG, 15e3, 50.0, 10),
        ]
    ]
    assert [item.candidate for item in _short_list(items)] == [COULOMB, DRAG]


@pytest.mark.parametrize("horizon", [HORIZONS[0], FURTHER])
def test_a_small_change_of_a_part_is_the_likeliest(swung, horizon):
    search = swung(ViscousFriction(2e-5))
    base, starts = settled_at(search, (), search.parameters.start)
    likeliest = sift(search, base, starts, search.parts(()), horizon)
    assert likeliest[0].candidate.effect == "viscous_friction"
    assert all(run.pieces == len(run.reading) and run.follows[1:].all() for run in search.runs)
