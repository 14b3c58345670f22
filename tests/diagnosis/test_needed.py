"""What is found has a size, foretells what was held out, and is told by what makes it another law."""

import numpy as np

from jaxflex.diagnosis import study as studied
from jaxflex.diagnosis.calibrate import Fit, Freedom
from jaxflex.diagnosis.catalogue import Candidate
from jaxflex.diagnosis.foretell import foretell
from jaxflex.diagnosis.hypothesis import Hypothesis
from jaxflex.diagnosis.needed import drop_unconfirmed, drop_unseen, is_seen, name_uneven_first
from jaxflex.diagnosis.normal import Normal
from jaxflex.diagnosis.outcome import Outcome
from jaxflex.diagnosis.prepare import HeldOut
from jaxflex.diagnosis.result import Estimate
from jaxflex.diagnosis.study import Study
from jaxflex.effects import QuadraticDrag

DRAG = Candidate("quadratic_drag", "joint_1", ("coefficient",))
OFFSET = Candidate("load_torque_bias", "joint_1", ("torque",))
RIPPLE = Candidate("cogging_torque", "joint_1", ("sine", "cosine"), (("order", 4.0),))


def test_one_amplitude_beyond_its_deviation_is_enough(search):
    places = [search.parameters.position(*RIPPLE.key, name) for name in RIPPLE.amplitudes]

    def sizes(sine, cosine, std=1.0):
        return {k: Estimate(v, std, "N m") for k, v in zip(places, (sine, cosine), strict=True)}

    assert is_seen(sizes(0.1, -1.1), search, RIPPLE)
    assert not is_seen(sizes(0.9, -0.9), search, RIPPLE)
    assert is_seen(sizes(0.9, -0.9, np.inf), search, RIPPLE)  # of a motion that was lost


def test_effects_that_come_to_nothing_are_dropped_but_for_the_last(recorded):
    study = Study(*recorded(QuadraticDrag(1e-3)), HeldOut.ENDS, lambda line: None)
    search = study.search
    study.outcome = Outcome(search.climb((), search.parameters.start), search.starts(), np.inf)
    study.outcome.final = search.climb((DRAG, OFFSET, RIPPLE), search.parameters.start)
    study.outcome.final_starts = search.starts()
    study.outcome.gains = [3.0, 2.0, 1.0]
    drop_unseen(study)
    assert study.outcome.final.effects == (DRAG,)
    assert study.outcome.gains == [3.0]


def test_the_last_effects_are_dropped_that_held_out_runs_do_not_confirm(recorded, monkeypatch):
    """Of three the third leaves a ninth less there, the second most less; at the floor none is asked for more.

    One alone is kept if it foretells better than none.
    """
    left = {0: 60.0, 1: 50.0, 2: 10.0, 3: 9.0}
    study = Study(*recorded(QuadraticDrag(1e-3)), HeldOut.ENDS, lambda line: None)
    search, own = study.search, foretell

    def foretold(problem, runs, hypothesis):
        return own(problem, runs, hypothesis)._replace(misfits={"angle_1": left[len(hypothesis.effects)]})

    monkeypatch.setattr(studied, "foretell", foretold)
    nominal = search.climb((), search.parameters.start), search.starts()
    found = search.climb((DRAG, OFFSET, RIPPLE), search.parameters.start), search.starts()

    def dropped():
        study.outcome = Outcome(*nominal, np.inf)
        study.outcome.final, study.outcome.final_starts = found
        study.outcome.gains = [3.0, 2.0, 1.0]
        drop_unconfirmed(study)
        return study.outcome.final.effects

    assert DRAG in dropped()
    assert RIPPLE not in dropped()
    left |= {2: 55.0, 3: 60.0}
    assert dropped() == (DRAG,)
    left |= {0: 40.0}
    assert dropped() == () and study.outcome.gains == []
    left |= {3: 1.5}
    assert dropped() == (DRAG, OFFSET, RIPPLE)


def test_a_large_asymmetry_is_told_before_the_friction_that_it_changes(search):
    friction = Candidate("coulomb_friction", "joint_1", ("torque",))
    uneven = Candidate("asymmetric_friction", "joint_1", ("torque",))

    def told(asymmetry):
        vector = search.parameters.start.copy()
        for effect, size in ((friction, 0.02), (uneven, asymmetry)):
            vector[search.parameters.position(*effect.key, "torque")] = size
        fit = Fit(vector, Freedom.full([]), 1.0, 0.0, Normal(np.eye(0), np.zeros(0), 1.0, 0.0, 1))
        found = Hypothesis((DRAG, friction, uneven), fit, 1, {1: 1.0})
        outcome = Outcome(found, search.starts(), np.inf)
        outcome.gains, outcome.rivals = [1.0, 2.0, 3.0], [(2, found)]
        name_uneven_first(search, outcome)
        return outcome.final.effects, outcome.gains, outcome.rivals[0][0]

    assert told(-0.01) == ((DRAG, uneven, friction), [1.0, 3.0, 2.0], 1)
    assert told(0.003) == ((DRAG, friction, uneven), [1.0, 2.0, 3.0], 2)


def test_an_asymmetry_needs_a_friction_that_it_changes(search):
    uneven, friction = ("asymmetric_friction", "joint_1"), ("stribeck_friction", "joint_1")
    needs = search.parameters.has_what_it_changes
    assert not needs(uneven, {("coulomb_friction", "joint_2"), ("quadratic_drag", "joint_1")})
    assert needs(uneven, {friction})
    assert needs(friction, set())
