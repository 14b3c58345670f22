"""What is tried beside what was found, and what the search makes of it."""

from jaxflex.diagnosis import find
from jaxflex.diagnosis.catalogue import Candidate
from jaxflex.diagnosis.find import _added_to, _short_list
from jaxflex.diagnosis.hypothesis import Ranked
from jaxflex.diagnosis.outcome import Outcome
from jaxflex.diagnosis.trial import settled_at

COULOMB = Candidate("coulomb_friction", "joint_1", ("torque",))
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
