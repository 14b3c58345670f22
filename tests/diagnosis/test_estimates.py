"""What is found has a size, or is not there."""

import numpy as np

from jaxflex.diagnosis.catalogue import Candidate
from jaxflex.diagnosis.estimates import drop_unseen, is_seen
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
