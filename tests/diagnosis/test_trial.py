"""Candidates tried beside what was found before them, to all pieces or to a part of them."""

import dataclasses

import numpy as np
import pytest

from jaxflex.diagnosis.calibrate import Fit, Freedom
from jaxflex.diagnosis.catalogue import Candidate
from jaxflex.diagnosis.hypothesis import CLOSE, SOME, Hypothesis, Ranked, Search
from jaxflex.diagnosis.normal import Normal
from jaxflex.diagnosis.outcome import Outcome
from jaxflex.diagnosis.rivals import prune
from jaxflex.diagnosis.trial import (
    Confirmed,
    Trial,
    confirmed_from,
    followed,
    settled_at,
    worth_it,
)
from jaxflex.effects import CoulombFriction, StribeckFriction

COUNT = 10_000
SHAPE = (("stribeck_rate", 0.3), ("presliding", 1e-4))
STRIBECK = Candidate(
    "stribeck_friction", "joint_1", ("torque", "level"), SHAPE, ("stribeck_rate", "presliding")
)
COULOMB = Candidate("coulomb_friction", "joint_1", ("torque",), (("presliding", 1e-4),), ("presliding",))
DRAG = Candidate("quadratic_drag", "joint_1", ("coefficient",))
SPRING = Candidate("joint_flexibility", "joint_1", ("compliance",))
GAIN = Candidate("sensor_gain", "tip_deflection_1", ("gain",))
FRICTION = 0.01  # N m


@pytest.fixture(scope="module")
def long(swung):
    """What a dry axis showed in twelve seconds."""
    return swung(CoulombFriction(FRICTION, presliding=1e-4), duration=12.0)


def torque(search, found):
    return found.fit.vector[search.parameters.position(*COULOMB.key, "torque")]


def test_a_part_of_the_pieces_says_what_is_missing(long):
    start = long.parameters.start
    base, starts = settled_at(long, (), start)
    fitted = long.climb((), start, to=1)
    trial = Trial(long, fitted, long.starts(), {1: 3.0}, by_some=True)
    assert trial.share == pytest.approx(1 / SOME, rel=0.1)
    assert trial.explained == {1: 3.0 * trial.share}
    trial.confirm([Ranked(DRAG, (1e-4,), 0.0, 0.0), Ranked(COULOMB, (0.005,), 0.0, 0.0)], base, starts)
    assert [entry.found.effects for entry in trial.worthy] == [(COULOMB,)]
    chosen = trial.simplest(trial.worthy)
    assert chosen.found.fit.count < fitted.fit.count
    # gone on with from the arm as stated, all its pieces settled
    stated, stated_starts = trial.base(chosen)
    assert stated.fit.count == fitted.fit.count and not stated.is_fitted
    assert not stated.fit.vector[: len(long.parameters.nominal)].any()
    assert torque(long, stated) == torque(long, chosen.found)
    found, found_starts = followed(long, stated, stated_starts, chosen.found.fit.vector)
    assert found.fit.level < 1.2
    assert torque(long, found) == pytest.approx(FRICTION, rel=0.02)
    assert [len(kept) for kept, _ in found_starts] == [run.pieces for run in long.runs]


def test_few_pieces_are_all_fitted(swung):
    search = swung(CoulombFriction(FRICTION, presliding=1e-4))
    base, starts = settled_at(search, (), search.parameters.start)
    trial = Trial(search, base, starts, {}, by_some=True)
    assert not trial.by_some and trial.search is search
    trial.confirm([Ranked(COULOMB, (0.005,), 0.0, 0.0)], base, starts)
    (confirmed,) = trial.confirmed
    assert confirmed.found.is_fitted
    assert trial.base(confirmed) == (confirmed.found, confirmed.starts)


def test_what_was_fitted_is_not_fitted_again(swung, monkeypatch):
    search = swung()
    base, starts = settled_at(search, (), search.parameters.start)
    found = search.climb((), base.fit.vector, to=1)
    seen = []
    climb = Search.climb
    monkeypatch.setattr(
        Search, "climb", lambda *args, **options: seen.append(options["begun"]) or climb(*args, **options)
    )
    for first in (base, found):
        assert followed(search, first, starts, first.fit.vector)[0].costs.keys() == {1, 3, 10}
    assert seen == [None, found]


def test_what_nothing_shows_is_gone_on_with(swung, monkeypatch):
    search = swung()
    base, starts = settled_at(search, (), search.parameters.start)
    found = search.climb((), base.fit.vector, to=1)
    hidden = dataclasses.replace(search.problem.setting, hidden=[1])
    monkeypatch.setattr(search.problem, "setting", hidden)
    fitted = []
    monkeypatch.setattr(Search, "climb", lambda *args, **options: fitted.append(options["begun"]) or found)
    followed(search, found, starts, found.fit.vector)
    assert fitted == [None]


def test_those_that_are_as_good_are_compared_once(long, monkeypatch):
    start = long.parameters.start
    base, starts = settled_at(long, (), start)
    fitted = long.climb((), start, to=1)
    trial = Trial(long, fitted, long.starts(), {}, by_some=False)
    trial.confirm([Ranked(COULOMB, (0.005,), 0.0, 0.0)], base, starts)
    (confirmed,) = trial.confirmed
    settled, further = trial.settled(confirmed), trial.followed(confirmed)
    monkeypatch.setattr(Search, "climb", None)
    assert trial.settled(confirmed) is settled is trial.settled(settled)
    assert trial.followed(confirmed) is further


def test_what_is_needed_is_seen_in_a_part_of_the_pieces(long, monkeypatch):
    """Friction that a drag was added to, which does nothing."""
    start = long.parameters.start
    settled_at(long, (), start)
    nominal, starts = long.climb((), start, to=1), long.starts()
    outcome = Outcome(nominal, starts, 100.0)
    outcome.final = long.confirm(nominal, starts, Ranked(COULOMB, (0.005,), 0.0, 0.0), 1)
    outcome.final = long.confirm(outcome.final, long.starts(), Ranked(DRAG, (1e-6,), 0.0, 0.0), 1)
    outcome.final_starts = long.starts()
    fitted = []
    climb = Search.climb

    def watched(self, effects, *args, **options):
        fitted.append((effects, self.runs[0].pieces == long.runs[0].pieces))
        return climb(self, effects, *args, **options)

    monkeypatch.setattr(Search, "climb", watched)
    prune(long, outcome)
    assert outcome.final.effects == (COULOMB,)
    assert ((DRAG,), True) not in fitted and ((COULOMB,), True) in fitted
    without = climb(long, (), start, to=1)
    assert outcome.gains[0] == pytest.approx(without.costs[1] - outcome.final.costs[1], rel=0.5)


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


def reached(effects, costs):
    """A hypothesis that came to these costs."""
    normal = Normal(np.eye(1), np.zeros(1), 0.0, 0.0, COUNT)
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

    class Settled(Trial):
        def __init__(self):
            self.search, self.by_some, self._settled = Settling(), False, {}

    gain, spring = reached((GAIN,), {1: 8.26e3, 10: 9.09e3}), reached((SPRING,), {1: 8.37e3, 10: 8.94e3})
    assert gain.strength(spring) > spring.strength(gain) > 0
    chosen = Settled().simplest([Confirmed(200.0, gain, [], []), Confirmed(200.1, spring, [], [])]).found
    assert chosen.effects == (SPRING,) and chosen.costs == {1: 8.22e3, 10: 8.94e3}


@pytest.mark.parametrize(
    "effects, left, gone, worth",
    [
        ((), 10.0, 0.4, True),
        ((), 10.0, 0.2, False),
        ((DRAG,), 10.0, 0.4, False),  # one more that leaves most of what is far from explained
        ((DRAG,), 10.0, 0.6, True),
        ((DRAG,), 1.9, 0.4, True),
        ((DRAG,), 1.2, 0.0, True),  # little is left: statistics decide
    ],
)
def test_an_effect_has_to_take_a_share_of_what_is_left(effects, left, gone, worth):
    before = reached(effects, {1: left * COUNT})
    after = reached((*effects, SPRING), {1: (left - gone * (left - 1)) * COUNT})
    assert worth_it(before, after) == worth
