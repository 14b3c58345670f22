"""What effects account for, over short horizons and long ones."""

import numpy as np

from jaxflex.diagnosis.calibrate import Fit, Freedom
from jaxflex.diagnosis.catalogue import Candidate
from jaxflex.diagnosis.describe import _verdict, laws
from jaxflex.diagnosis.find import MOST_EFFECTS
from jaxflex.diagnosis.hypothesis import HORIZONS, Hypothesis
from jaxflex.diagnosis.normal import Normal
from jaxflex.diagnosis.outcome import Outcome

COUNT = 1000


def fitted(*costs):
    """A hypothesis with these costs over the first horizons."""
    found = Fit(
        np.zeros(0), Freedom.full([]), costs[-1], 0.0, Normal(np.eye(0), np.zeros(0), costs[-1], 0.0, COUNT)
    )
    return Hypothesis((), found, HORIZONS[len(costs) - 1], dict(zip(HORIZONS, costs, strict=False)))


def outcome(final, nominal_level, level):
    found = Outcome(fitted(5e3), [], nominal_level)
    found.final, found.level = final, level
    return found


def test_what_is_explained_grows_with_the_horizon():
    short, middle, long = outcome(fitted(1e3, 1.1e3, 1.2e3), 101.0, 1.2).explained_over().values()
    assert short == 4e3
    assert np.isclose(long, 99.8 * COUNT)
    assert np.isclose(middle, 0.3 * long)


def test_a_motion_that_was_lost_over_a_second_counts_as_over_the_shortest_horizon():
    explained = outcome(fitted(1e3), np.inf, 1.2).explained_over()
    assert set(explained.values()) == {4e3}


def test_what_a_longer_horizon_leaves_bounds_what_a_shorter_one_does():
    assert np.isclose(fitted(5e3, 1.2e3, 1.1e3).closest, 1.1)
    assert np.isclose(fitted(1.1e3, 1.2e3, 5e3).closest, 1.1)


def test_an_effect_that_is_dropped_takes_its_gain_and_its_rivals_along():
    found, rival = outcome(fitted(1e3), 101.0, 1.2), fitted(2e3)
    found.gains, found.rivals = [1.0, 2.0, 3.0], [(0, rival), (1, rival), (2, rival)]
    found.drop(1, rival, [])
    assert found.final is rival
    assert found.gains == [1.0, 3.0]
    assert [place for place, _ in found.rivals] == [0, 1]


def test_effects_enough_to_imitate_anything_explain_nothing_that_is_left():
    found = outcome(fitted(5e3, 5e3, 5e3), 1e3, 5.0)
    effect = Candidate("quadratic_drag", "joint_1", ("coefficient",))
    verdicts = []
    for count in (1, MOST_EFFECTS):
        found.final.effects = (effect,) * count
        verdicts += [_verdict(found, 5.0, gone=0.996), _verdict(found, 1.1, gone=0.999)]
    assert verdicts == ["missing_effect", "missing_effect", "unexplained", "missing_effect"]


def test_several_effects_must_explain_more_than_one():
    found = outcome(fitted(5e3, 5e3, 5e3), 1e3, 5.0)
    effects = tuple(
        Candidate(name, "joint_1", (name,)) for name in ("quadratic_drag", "cogging_torque", "gravity")
    )
    verdicts = []
    for count in (1, 3):
        found.final.effects = effects[:count]
        verdicts += [_verdict(found, 5.0, gone) for gone in (0.85, 0.95, 0.99)]
    missing, unknown = "missing_effect", "unexplained"
    assert verdicts == [unknown, missing, missing, unknown, unknown, missing]


def test_what_a_joint_feels_by_its_direction_alone_is_one_law():
    def at(joint, *names):
        return tuple(Candidate(name, f"joint_{joint}", ("torque",)) for name in names)

    assert laws(at(1, "coulomb_friction", "asymmetric_friction", "load_torque_bias")) == 1
    assert laws(at(1, "coulomb_friction") + at(2, "load_torque_bias")) == 2
    assert laws(at(1, "coulomb_friction", "cogging_torque")) == 2
    found = outcome(fitted(5e3, 5e3, 5e3), 1e3, 5.0)
    found.final.effects = at(1, "coulomb_friction", "load_torque_bias")
    assert [_verdict(found, 5.0, gone) for gone in (0.85, 0.95)] == ["unexplained", "missing_effect"]
