"""Motor and link that come apart: found from sizes far from the true one, with pieces that may run away."""

import dataclasses

import numpy as np
import pytest

from jaxflex.diagnosis.calibrate import held_back
from jaxflex.diagnosis.catalogue import Candidate
from jaxflex.diagnosis.hypothesis import HORIZONS
from jaxflex.diagnosis.loose_joint import FLANKS, best_from, loosened
from jaxflex.diagnosis.prepare import HeldOut, make_problem
from jaxflex.diagnosis.study import Study
from jaxflex.files.arm_file import ArmFile

from .test_shooting import nominal, record

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


@pytest.mark.parametrize("size", [GAP / 3, 3 * GAP])
def test_play_is_found_from_a_third_and_from_three_times_its_size(study, size):
    found = best_from(study.search, PLAY, (size,))
    place = study.search.parameters.position("backlash", "joint_1", "gap")
    assert found.fit.level < 1.5
    np.testing.assert_allclose(found.fit.vector[place], GAP, rtol=0.03)
    over_a_second = study.search.climb(found.effects, found.fit.vector)
    assert over_a_second.horizon == HORIZONS[-1] and over_a_second.fit.level < 1.1
    np.testing.assert_allclose(over_a_second.fit.vector[place], GAP, rtol=0.01)


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
