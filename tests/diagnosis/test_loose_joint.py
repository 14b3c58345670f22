"""Motor and link that come apart: found from sizes far from the true one, with pieces that may run away."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from controllers import Replayed, Step
from jaxflex.diagnosis.adopt import adopt
from jaxflex.diagnosis.calibrate import held_back
from jaxflex.diagnosis.catalogue import Candidate
from jaxflex.diagnosis.flanks import PLACES, join_pieces
from jaxflex.diagnosis.foretell import LOST, foretell
from jaxflex.diagnosis.hypothesis import HORIZONS, Hypothesis, Search
from jaxflex.diagnosis.loose_joint import FLANKS, TURNS, best_from, first_gap, loosened, turned
from jaxflex.diagnosis.plant import hidden_loads, twist_place
from jaxflex.diagnosis.prepare import HeldOut, make_problem
from jaxflex.diagnosis.runs import starts_of
from jaxflex.diagnosis.study import Study
from jaxflex.files.arm_file import ArmFile

from .test_shooting import nominal, record

pytestmark = pytest.mark.optimised

GAP = 0.01  # rad
PLAY = Candidate("backlash", "joint_1", ("gap",))


@pytest.fixture(scope="module")
def study():
    """An arm without play, taken apart, and what the same arm with play and harder flanks showed."""
    arm = nominal()
    joint = dataclasses.replace(
        arm.joints[0], play=GAP, contact_stiffness=200.0, contact_damping=0.05, motor_share=0.5
    )
    recording, _ = record(dataclasses.replace(arm, joints=(joint,)))
    file = ArmFile(arm, {"default": 0.01}, None)
    return Study(loosened(file, 0, FLANKS), [recording], HeldOut.ENDS, lambda line: None)


@pytest.mark.parametrize("size", [pytest.param(GAP / 3, marks=pytest.mark.slow), 3 * GAP])
def test_play_is_found_from_a_third_and_from_three_times_its_size(study, size):
    found = best_from(study.search, PLAY, (size,))
    place = study.search.parameters.position("backlash", "joint_1", "gap")
    assert found.fit.level < 1.5
    np.testing.assert_allclose(found.fit.vector[place], GAP, rtol=0.03)
    over_a_second = study.search.climb(found.effects, found.fit.vector)
    assert over_a_second.horizon == HORIZONS[-1] and over_a_second.fit.level < 1.1
    np.testing.assert_allclose(over_a_second.fit.vector[place], GAP, rtol=0.01)


def test_what_play_does_not_explain_with_flanks_as_guessed_is_left_at_that(study):
    found = best_from(study.search, PLAY, (3 * GAP,), most=0.5)
    contact = [k for k, part in enumerate(study.search.parameters.nominal) if part.is_of_contact]
    assert found.costs.keys() == {HORIZONS[0]} and found.fit.level > 0.5
    assert not found.fit.vector[contact].any()


def test_a_load_at_rest_between_the_flanks_begins_where_those_after_it_say(study):
    """No reading of the first piece shows where in the play its load rests."""
    problem = study.prepared.problem
    whole, parameters = study.prepared.calibration[0], study.search.parameters
    vector = adopt(parameters, parameters.start, PLAY, (GAP,))
    run = whole.only(np.arange(whole.pieces))
    rest, twist = 0.3 * GAP, twist_place(parameters.arm.assemble(), 0)
    run.starts[0] = 0.0
    run.starts[0, twist] = rest
    for _ in range(3):
        shown = problem.predict(run, vector)
        run.starts[1:] = shown.end[:-1]
    true = run.starts[:3].copy()
    run.reading = problem.predict(run, vector).reading
    join_pieces(problem, [run], vector, 3)
    assert run.starts[0, twist] == rest
    run.starts[0, twist] = -rest
    before = problem.misfit(run, problem.predict(run, vector))[:3]
    join_pieces(problem, [run], vector, 3)
    assert abs(run.starts[0, twist] - rest) < GAP / PLACES
    assert problem.misfit(run, problem.predict(run, vector))[:3].mean() < 0.1 * before.mean()
    np.testing.assert_allclose(run.starts[1:3, twist], true[1:, twist], atol=GAP / PLACES)
    run.measured[0] = 0.0
    run.starts[0] = 0.1  # bent by a fit over fewer pieces
    join_pieces(problem, [run], vector, 3)
    np.testing.assert_allclose(run.starts[0], true[0], atol=GAP / PLACES)


@pytest.mark.parametrize(
    "levels, kept",
    [
        ((1.29, 1.16, 0.96), 0.96),  # little of the whole, much of what is beyond the noise
        ((1.29, 1.28, 0.96), 1.29),
        ((1.05,), 1.05),
        ((9.0, 5.0, 3.0, 2.0, 1.0), 2.0),  # three turns
    ],
)
def test_the_other_flank_is_tried_while_that_takes_much_of_what_is_beyond_the_noise(
    axis, monkeypatch, levels, kept
):
    settled = axis.search.settle(axis.search.parameters.start)

    def fitted(level):
        cost = level * settled.count
        return Hypothesis((PLAY,), dataclasses.replace(settled, cost=cost, prior=0.0), 1, {1: cost})

    class Turning(Search):
        def climb(self, *args, **kwargs):
            return next(coming)

    coming = iter([fitted(level) for level in levels[1:]])
    search = Turning(axis.search.problem, axis.search.runs, print)
    monkeypatch.setattr("jaxflex.diagnosis.loose_joint.choose_flanks", lambda *args: None)
    assert turned(search, fitted(levels[0]), 0, TURNS).fit.level == pytest.approx(kept)


def test_pieces_are_taken_as_often_as_they_are_asked_for(study):
    whole = study.prepared.calibration[0]
    some = whole.only(np.array([4, 4, 7]))
    np.testing.assert_array_equal(some.places, whole.places[[4, 4, 7]])
    np.testing.assert_array_equal(some.reading, whole.reading[[4, 4, 7]])
    some.starts[0] = np.nan
    assert np.isfinite(whole.starts).all()


@pytest.fixture(scope="module")
def axis():
    """A bare axis taken apart, and what one with play showed: its motor's angle alone."""
    motor = jf.DCMotor(1.2, 0.06, 0.06)
    arm = jf.Arm((), (jf.Joint(hub_inertia=2e-3, viscous_friction=1e-3, motor=motor),), drive="voltage")
    loose = dataclasses.replace(
        arm.joints[0], play=GAP, contact_stiffness=60.0, contact_damping=0.1, motor_share=0.5
    )
    times = jnp.linspace(0.0, 4.0, 2001)
    voltage = 2.0 * jnp.sin(5.0 * times) + 1.0 * jnp.sin(11.0 * times)
    true = dataclasses.replace(arm, joints=(loose,))
    run = jf.simulate(true, Replayed(voltage[:, None], 0.002), Step((0.0,), (0.0,)), times)
    noise = 1e-4 * np.random.default_rng(0).normal(size=len(times))
    channels = {"voltage_1": np.asarray(run["voltage_1"]), "angle_1": np.asarray(run["angle_1"]) + noise}
    recording = jf.Recording(np.asarray(times), channels, ())
    file = loosened(ArmFile(arm, {"default": 0.01}, None), 0, FLANKS)
    return Study(file, [recording], HeldOut.ENDS, lambda line: None, carried=True)


def test_a_load_that_nothing_shows_goes_on_from_piece_to_piece(axis, study):
    problem, run = axis.prepared.problem, axis.prepared.calibration[0]
    hidden = problem.setting.hidden
    assert hidden == [1, 3] and hidden_loads(study.search.parameters.arm.assemble()) == []
    assert (problem.setting.start_spread[hidden] < 1e-5).all()
    vector = adopt(axis.search.parameters, axis.search.parameters.start, PLAY, (GAP,))
    shown = run.starts[:, [0, 2]].copy()
    for _ in range(len(run.starts)):
        problem.bend(run, vector)
    ends = problem.predict(run, vector).end[:-1][:, hidden]
    gone_on = np.abs(run.starts[1:][:, hidden] - ends).max(1) < 1e-4
    assert gone_on.mean() > 0.6  # the others would fit clearly worse
    np.testing.assert_array_equal(run.starts[:, [0, 2]], shown)


@pytest.mark.slow
@pytest.mark.parametrize("size", [GAP / 2, 2 * GAP])
def test_play_before_a_load_that_nothing_shows_is_found(axis, size):
    found = best_from(axis.search, PLAY, (size,))
    over_a_second = axis.search.climb(found.effects, found.fit.vector)
    assert over_a_second.horizon == HORIZONS[-1] and over_a_second.fit.level < 1.1
    place = axis.search.parameters.position("backlash", "joint_1", "gap")
    np.testing.assert_allclose(over_a_second.fit.vector[place], GAP, rtol=0.02)


def test_a_load_that_cannot_be_followed_is_foretold_for_as_long_as_it_can(axis, monkeypatch):
    vector = adopt(axis.search.parameters, axis.search.parameters.start, PLAY, (GAP,))
    settled = axis.search.settle(vector)
    found = Hypothesis((PLAY,), settled, 1, {1: settled.cost})
    runs = axis.prepared.held_out
    tried = []

    def fitted(problem, runs, vector, freedom, horizon, *args, **kwargs):
        level = {1: 1.0, 3: 0.9 * LOST, 10: LOST**2}[horizon]
        cost = level * settled.count
        for run in runs:
            run.starts = run.starts + 1e-3 * horizon
        tried.append((horizon, starts_of(runs)))
        return dataclasses.replace(settled, cost=cost, prior=0.0)

    monkeypatch.setattr("jaxflex.diagnosis.foretell.fit", fitted)
    monkeypatch.setattr("jaxflex.diagnosis.further.fit", fitted)
    told = foretell(axis.prepared.problem, runs, found)
    assert [horizon for horizon, _ in tried] == [1, 3, 10]
    np.testing.assert_array_equal(told.starts[0][0], tried[1][1][0][0])
    assert told.span == pytest.approx(0.3)


@pytest.mark.parametrize(
    "levels, gap",
    [
        ({1: 1.3, 3: 9.0, 10: 20.0}, (1, 1.3)),
        ({1: 0.2, 3: 9.0, 10: 20.0}, (3, 9.0)),
        ({1: 1.0, 3: 1.05, 10: 1.6}, (10, 1.6)),
        ({1: 1.0, 3: 1.0, 10: 1.0}, (1, 1.0)),
    ],
)
def test_a_joint_is_judged_over_the_shortest_horizon_that_leaves_something(levels, gap):
    class Told(Study):
        def __init__(self):
            pass

        def level_of_some(self, horizon):
            return levels[horizon]

    assert first_gap(Told()) == gap


def test_harder_flanks_take_more_steps(study):
    parameters, problem = study.search.parameters, study.prepared.problem
    hard = parameters.start.copy()
    hard[[part.name for part in parameters.nominal].index("contact_stiffness")] = 2.0
    soft = int(problem.stepping(parameters.start).substeps)
    assert soft == problem.setting.substeps
    assert soft < int(problem.stepping(hard).substeps) <= soft * np.exp(FLANKS["contact_stiffness"][1]) + 1


def test_a_piece_that_runs_away_is_put_back_alone():
    recording, _ = record(nominal())
    prepared = make_problem(ArmFile(nominal(), {"default": 0.03}, None), [recording])
    problem, run = prepared.problem, prepared.calibration[0]
    vector = problem.setting.parameters.start
    before = problem.linearise(run, vector, [])
    starts = run.starts.copy()
    run.starts[3, 0] += 0.5
    run.starts[5, 0] += 1e-6
    now = held_back(problem, run, vector, starts, before, problem.refresh(run, vector, before))
    np.testing.assert_array_equal(run.starts[3], starts[3])
    assert run.starts[5, 0] == starts[5, 0] + 1e-6
    np.testing.assert_allclose(now.residual[3], before.residual[3])
