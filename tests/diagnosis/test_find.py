"""What is tried beside what was found, and what the search makes of it."""

import dataclasses

import pytest

from jaxflex.diagnosis import find
from jaxflex.diagnosis.catalogue import Candidate
from jaxflex.diagnosis.departure import is_suspect
from jaxflex.diagnosis.find import _added_to, _short_list, find_from, gone_on
from jaxflex.diagnosis.hypothesis import Hypothesis, Ranked, Search
from jaxflex.diagnosis.outcome import Outcome
from jaxflex.diagnosis.trial import settled_at
from jaxflex.effects import CoulombFriction, HubInertia

COULOMB = Candidate("coulomb_friction", "joint_1", ("torque",), (("presliding", 1e-4),), ("presliding",))
STRIBECK = Candidate("stribeck_friction", "joint_1", ("torque", "level"))
SPRING = Candidate("joint_flexibility", "joint_1", ("compliance",))
DRAG = Candidate("quadratic_drag", "joint_1", ("coefficient",))


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


@pytest.mark.parametrize("heavier, effects", [(2e-3, 2), pytest.param(1e-4, 1, marks=pytest.mark.slow)])
def test_what_sets_strained_parameters_straight_is_found_without_trying_all_parts(
    swung, monkeypatch, heavier, effects
):
    """Friction was found beside a hub twice as heavy as stated, or heavier by a twentieth."""
    search = swung(CoulombFriction(0.01, presliding=1e-4), HubInertia(heavier))
    start = search.parameters.start
    base, starts = settled_at(search, (), start)
    nominal = search.climb((), start, to=1)
    outcome = Outcome(nominal, search.starts(), 1e6)
    first = search.confirm(base, starts, Ranked(COULOMB, (0.01,), 0.0, 0.0), 1)
    monkeypatch.setattr(Search, "parts", None)
    found = find_from(search, first, outcome)
    assert found.final.effects[0].key == COULOMB.key
    assert len(found.final.effects) == effects
    assert not is_suspect(search.parameters, found.final)


@pytest.mark.parametrize(
    "added, moved, level, waits",
    [
        ((SPRING,), 9.0, 1.0, True),
        ((COULOMB, SPRING), 9.0, 1.0, True),
        ((SPRING,), 0.5, 1.0, False),  # parameters are where they were stated
        ((SPRING,), 9.0, 40.0, False),  # something else is left
        ((COULOMB,), 9.0, 1.0, False),
        ((), 9.0, 1.0, False),
    ],
)
def test_strain_beside_a_spring_is_left_to_a_joint_that_may_come_apart(
    search, monkeypatch, added, moved, level, waits
):
    base, starts = settled_at(search, (), search.parameters.start)
    fit = dataclasses.replace(base.fit, cost=level * base.fit.count, prior=0.0)
    fit.vector[: len(search.parameters.nominal)] = moved
    outcome = Outcome(dataclasses.replace(base, costs={1: 1e9}), starts, 1e3)
    outcome.final = Hypothesis(added, fit, 1, {1: fit.cost})
    outcome.level = level
    tried = []
    monkeypatch.setattr(find, "next_effect", lambda *args: tried.append(outcome.waiting))
    monkeypatch.setattr(find, "prune", lambda *args: None)
    found = _added_to(search, outcome, base, starts, waits=True)
    assert (found.waiting is not None) == waits and len(tried) == (not waits)
    assert gone_on(search, found) is outcome
    assert outcome.waiting is None and tried == [None]


def test_what_is_left_is_of_what_is_kept(search, monkeypatch):
    base, starts = settled_at(search, (), search.parameters.start)
    nominal = search.climb((), base.fit.vector)
    outcome = Outcome(nominal, search.starts(), 1.0)
    outcome.level = 50.0  # of effects that are dropped

    def pruned(search, outcome):
        outcome.final, outcome.final_starts = search.climb((), base.fit.vector), search.starts()

    monkeypatch.setattr(find, "next_effect", lambda *args: None)
    monkeypatch.setattr(find, "prune", pruned)
    assert _added_to(search, outcome, base, starts).level == outcome.final.fit.level
