"""What is tried beside what was found, and what the search makes of it."""

import pytest

from jaxflex.diagnosis import find
from jaxflex.diagnosis.catalogue import Candidate
from jaxflex.diagnosis.departure import is_suspect
from jaxflex.diagnosis.find import _added_to, _short_list, find_from
from jaxflex.diagnosis.hypothesis import Ranked
from jaxflex.diagnosis.outcome import Outcome
from jaxflex.diagnosis.trial import settled_at
from jaxflex.effects import CoulombFriction, HubInertia

COULOMB = Candidate("coulomb_friction", "joint_1", ("torque",), (("presliding", 1e-4),), ("presliding",))
STRIBECK = Candidate("stribeck_friction", "joint_1", ("torque", "level"))
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


@pytest.mark.parametrize("excused", [True, False])
def test_parameters_that_a_law_may_have_bent_are_excused_where_it_is_known_to_be_one(swung, excused):
    """Friction found beside a hub a third heavier than stated, ten of its standard deviations."""
    search = swung(CoulombFriction(0.01, presliding=1e-4), HubInertia(7e-4))
    start = search.parameters.start
    base, starts = settled_at(search, (), start)
    nominal = search.climb((), start, to=1)
    outcome = Outcome(nominal, search.starts(), 1e6)
    first = search.confirm(base, starts, Ranked(COULOMB, (0.01,), 0.0, 0.0), 1)
    found = find_from(search, first, outcome, excused=excused)
    assert found.final.effects[0].key == COULOMB.key
    assert len(found.final.effects) == (1 if excused else 2)
    assert is_suspect(search.parameters, found.final) == excused


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
