"""Which parts of an arm are gone on with."""

import numpy as np
import pytest

from jaxflex.diagnosis.calibrate import Fit, Freedom
from jaxflex.diagnosis.catalogue import Candidate
from jaxflex.diagnosis.find import FURTHER
from jaxflex.diagnosis.hypothesis import HORIZONS, Hypothesis, Ranked, Search
from jaxflex.diagnosis.normal import Normal
from jaxflex.diagnosis.sift import _promising, sift
from jaxflex.diagnosis.trial import settled_at
from jaxflex.effects import ViscousFriction

SPRING = Candidate("joint_flexibility", "joint_1", ("compliance",))


@pytest.mark.parametrize("horizon", [HORIZONS[0], FURTHER])
def test_a_small_change_of_a_part_is_the_likeliest(swung, horizon):
    search = swung(ViscousFriction(2e-5))
    base, starts = settled_at(search, (), search.parameters.start)
    likeliest = sift(search, base, starts, search.parts(()), horizon)
    assert likeliest[0].candidate.effect == "viscous_friction"
    assert all(run.pieces == len(run.reading) and run.follows[1:].all() for run in search.runs)


@pytest.mark.parametrize("friction, all_are", [(2e-5, True), (1e-2, False)])
def test_parts_far_behind_one_that_leads_clearly_are_not_followed(swung, monkeypatch, friction, all_are):
    search = swung(ViscousFriction(friction))
    base, starts = settled_at(search, (), search.parameters.start)
    parts, followed = search.parts(()), []
    climb = Search.climb

    def watched(self, effects, *args, begun=None, **options):
        if begun is not None:
            followed.append(effects[-1].effect)
        return climb(self, effects, *args, begun=begun, **options)

    monkeypatch.setattr(Search, "climb", watched)
    monkeypatch.setattr("jaxflex.diagnosis.sift._promising", lambda search, nothing, items: items)
    sift(search, base, starts, parts, FURTHER)
    assert "viscous_friction" in followed
    assert (len(followed) == len(parts)) == all_are


def nothing_found():
    """A hypothesis without effects that leaves something."""
    normal = Normal(np.eye(1), np.zeros(1), 0.0, 0.0, 10_000)
    return Hypothesis((), Fit(np.zeros(1), Freedom.full([]), 0.0, 0.0, normal), 1, {1: 1e4})


def test_what_makes_no_sense_beside_bent_parameters_is_tried_from_the_size_it_is_begun_with():
    lag = Candidate("sensor_lag", "angle_1", ("time",))
    better = [Candidate("sensor_gain", f"angle_{k}", ("gain",)) for k in range(6)]
    ranked = [Ranked(candidate, (0.1,), 10.0, 2.0) for candidate in (*better, lag)]

    class Ranking(Search):
        def __init__(self):
            pass

        def scored(self, *_):
            return ranked

    sizes = [
        (SPRING, 0.0),
        (SPRING, 0.1),
        *((candidate, 0.0) for candidate in better),
        (lag, 0.0),
        (lag, 0.1),
    ]
    items = [Ranked(candidate, (size,), 0.0, 0.0) for candidate, size in sizes]
    assert _promising(Ranking(), nothing_found(), items) == items[1:-2]
