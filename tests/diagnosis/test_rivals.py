"""Effects that are needed no more are dropped."""

import dataclasses

import numpy as np

from jaxflex.diagnosis.adopt import adopt
from jaxflex.diagnosis.catalogue import Candidate
from jaxflex.diagnosis.hypothesis import CLOSE, FAIR, Search
from jaxflex.diagnosis.outcome import Outcome
from jaxflex.diagnosis.rivals import is_all_there_is, prune

DRAG = Candidate("quadratic_drag", "joint_1", ("coefficient",))
OFFSET = Candidate("load_torque_bias", "joint_1", ("torque",))


def test_an_effect_of_no_size_is_dropped_whatever_the_others_leave(search):
    noise = 1e-3 * np.random.default_rng(1).normal(size=search.runs[0].reading.shape)
    rough = [dataclasses.replace(run, reading=run.reading + noise, slopes=None) for run in search.runs]
    search = Search(search.problem, rough, print)
    nominal = search.climb((), search.parameters.start)
    assert nominal.closest > CLOSE
    outcome = Outcome(nominal, search.starts(), np.inf)
    vector = adopt(search.parameters, nominal.fit.vector, OFFSET, (1e-3,))
    outcome.final = dataclasses.replace(
        nominal, effects=(DRAG, OFFSET), fit=dataclasses.replace(nominal.fit, vector=vector)
    )
    prune(search, outcome)
    assert DRAG not in outcome.final.effects


def test_a_rival_that_leaves_noise_alone_is_told_from_one_that_leaves_less(search):
    found = search.climb((), search.parameters.start, to=1)

    def leaving(level):
        fit = dataclasses.replace(found.fit, cost=level * found.fit.count + found.fit.prior)
        return dataclasses.replace(found, fit=fit)

    assert is_all_there_is(leaving(3.0), leaving(1.0))
    assert not is_all_there_is(leaving(30.0), leaving(1.01 * FAIR))
    assert not is_all_there_is(leaving(0.99 * CLOSE), leaving(1.0))
