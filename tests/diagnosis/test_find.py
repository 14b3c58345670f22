"""How candidates are fitted beside what was found before them."""

import dataclasses

import numpy as np
import pytest

from jaxflex.diagnosis.calibrate import Fit, Freedom
from jaxflex.diagnosis.catalogue import Candidate
from jaxflex.diagnosis.find import (
    _short_list,
    confirmed_from,
    simplest,
)
from jaxflex.diagnosis.hypothesis import CLOSE, Hypothesis, Ranked, Search
from jaxflex.diagnosis.normal import Normal
from jaxflex.effects import StribeckFriction

SHAPE = (("stribeck_rate", 0.3), ("presliding", 1e-4))
STRIBECK = Candidate(
    "stribeck_friction", "joint_1", ("torque", "level"), SHAPE, ("stribeck_rate", "presliding")
)
COULOMB = Candidate("coulomb_friction", "joint_1", ("torque",), (("presliding", 1e-4),), ("presliding",))
DRAG = Candidate("quadratic_drag", "joint_1", ("coefficient",))
SPRING = Candidate("joint_flexibility", "joint_1", ("compliance",))
GAIN = Candidate("sensor_gain", "tip_deflection_1", ("gain",))


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


def reached(effects, costs):
    """A hypothesis that came to these costs."""
    normal = Normal(np.eye(1), np.zeros(1), 0.0, 0.0, 10_000)
    return Hypothesis(effects, Fit(np.zeros(1), Freedom.full([]), 0.0, 0.0, normal), max(costs), costs)


def test_rivals_that_lead_over_different_horizons_are_settled_before_one_is_chosen():
    """A fit over a tenth of a second may end far up a valley that a second leads out of."""

    class Settling(Search):
        def __init__(self):
            pass

        def restart(self, starts):
            pass

        def climb(self, effects, vector, to):
            return reached(effects, {1: {SPRING: 8.22e3, GAIN: 8.26e3}[effects[-1]]})

    gain, spring = reached((GAIN,), {1: 8.26e3, 10: 9.09e3}), reached((SPRING,), {1: 8.37e3, 10: 8.94e3})
    assert gain.strength(spring) > spring.strength(gain) > 0
    _, chosen, _ = simplest(Settling(), [(200.0, gain, []), (200.1, spring, [])])
    assert chosen.effects == (SPRING,) and chosen.costs == {1: 8.22e3, 10: 8.94e3}
