"""The whole workflow on data in which the effect is hidden, made by plants of another making."""

import dataclasses
import json
import math
from pathlib import Path
from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from controllers import Replayed, Step
from experiments.blind.make import make_cases, write_case
from jaxflex.diagnosis import diagnose
from jaxflex.diagnosis.catalogue import Candidate
from jaxflex.diagnosis.diagnose import _has_not_seen
from jaxflex.diagnosis.gauge import by_gauge
from jaxflex.diagnosis.hypothesis import Search
from jaxflex.diagnosis.outcome import Outcome
from jaxflex.diagnosis.parameters import _nominal
from jaxflex.diagnosis.prepare import HeldOut, make_problem
from jaxflex.diagnosis.study import Study
from jaxflex.effects import VoltageSaturation

pytestmark = pytest.mark.optimised

SHARED = Path(__file__).resolve().parents[3] / "shared"


def answer(folder):
    recordings = [jf.read_recording(path) for path in sorted(folder.glob("run_*.csv"))]
    return diagnose(jf.read_arm_file(folder / "arm.toml"), recordings)


@pytest.fixture(scope="module")
def hidden(tmp_path_factory):
    """Two blind cases: a cable that leaves a gap of about ten, nothing."""
    folder = tmp_path_factory.mktemp("cases")
    cases = make_cases("single_link", [("cable_stiffness",), ()], [0.01], [0], typical=True)
    assert 5.0 < cases[0].gap["size"] < 20.0
    for case in cases:
        write_case(case, folder / case.name)
    return {(case.truth[0][0] if case.truth else "nothing"): (folder / case.name, case) for case in cases}


def test_what_is_hidden_is_named_and_the_gap_closes(hidden):
    is_named_and_closes_the_gap("cable_stiffness", *hidden["cable_stiffness"])


@pytest.mark.slow
def test_a_slow_instrument_is_named_and_the_gap_closes(tmp_path):
    (case,) = make_cases("single_link", [("sensor_lag",)], [10.0], [0])
    write_case(case, tmp_path)
    is_named_and_closes_the_gap("sensor_lag", tmp_path, case)


def is_named_and_closes_the_gap(name, folder, case):
    found = answer(folder)
    assert found.verdict in ("missing_effect", "ambiguous")
    assert name in [e.name for e in (*found.effects, *found.alternatives)]
    for channel, floor in found.gap.noise_floor.items():
        assert found.gap.after[channel] < 1.25 * floor
    assert max(found.gap.before[c] / f for c, f in found.gap.noise_floor.items()) > 1.5
    ((_, location, truth),) = case.truth
    first = found.effects[0]
    if first.name == name:
        assert first.location == location
        for key, value in truth.items():
            estimate = first.parameters[key]
            assert abs(estimate.value - value) < max(3 * estimate.std, 0.1 * abs(value))
    for part in _nominal(jf.read_arm_file(folder / "arm.toml")):
        moved = math.log(found.calibrated[part.name].value / part.value)
        assert abs(moved) < 4 * part.spread, f"{part.name} left its stated uncertainty"
    json.dumps(found.to_json())
    assert [e.name for e in found.improved.effects] == [e.name for e in found.effects]


def test_parameters_do_not_depend_on_what_was_foretold_before(hidden):
    folder, _ = hidden["nothing"]
    recordings = [jf.read_recording(path) for path in sorted(folder.glob("run_*.csv"))]
    study = Study(jf.read_arm_file(folder / "arm.toml"), recordings, HeldOut.RUNS, lambda line: None)
    search = study.search
    study.outcome = Outcome(search.climb((), search.parameters.start, to=1), search.starts(), np.inf)
    study.foretold()
    ends = []
    for run in (None, *study.prepared.held_out):
        if run is not None:
            run.starts = run.starts + 1.0  # as a hypothesis that cannot follow leaves them
        ends.append(study._fitted_to_all(study.outcome.final).fit.vector)
    np.testing.assert_allclose(ends[1], ends[0], rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize(
    "name, where_it_shows",
    [
        pytest.param("voltage_saturation", "in the second run alone", marks=pytest.mark.slow),
        pytest.param(
            "viscous_friction", "in how far the stated parameters would have to go", marks=pytest.mark.slow
        ),
        pytest.param("joint_flexibility", "between rotor and load", marks=pytest.mark.slow),
    ],
)
def test_what_a_bare_axis_hides_is_named(tmp_path, name, where_it_shows):
    (case,) = make_cases("axis", [(name,)], [10.0], [0])
    write_case(case, tmp_path)
    found = answer(tmp_path)
    assert found.verdict == "missing_effect", where_it_shows
    assert [e.name for e in found.effects] == [name]
    for channel, floor in found.gap.noise_floor.items():
        assert found.gap.after[channel] < 1.2 * floor


def test_what_shows_at_the_end_alone_is_named():
    """Where the end is held out nothing is missing; so it is searched, and the beginning held out."""
    motor = jf.DCMotor(1.2, 0.06, 0.06)
    arm = jf.Arm((), (jf.Joint(hub_inertia=2e-3, viscous_friction=1e-3, motor=motor),), drive="voltage")
    times = jnp.linspace(0.0, 2.0, 1001)
    louder = 1.0 + 2.0 * (times > 1.5)
    command = louder * jnp.sin(8.0 * times)
    pushes = Replayed(command[:, None], 0.002)
    true = dataclasses.replace(arm, effects=(VoltageSaturation(2.2),))
    run = jf.simulate(true, pushes, Step((0.0,), (0.0,)), times)
    noise = 1e-4 * np.random.default_rng(0).normal(size=1001)
    channels = {"voltage_1": np.asarray(command), "angle_1": np.asarray(run["angle_1"]) + noise}
    said = []
    recording = jf.Recording(np.asarray(times), channels, ())
    found = diagnose(jf.ArmFile(arm, {"default": 0.03}, None), [recording], said.append)
    assert any(HeldOut.BEGINNINGS.value in line for line in said)
    assert [effect.name for effect in found.effects] == ["voltage_saturation"]
    assert found.effects[0].parameters["limit"].value == pytest.approx(2.2, rel=0.02)
    assert found.gap.after["angle_1"] < 1.2 * found.gap.noise_floor["angle_1"]


@pytest.mark.parametrize(
    "searched, held_out, named, strained, seen",
    [
        (1.0, 1.03, False, False, True),
        (0.9, 1.0, False, False, False),
        (1.0, 1.5, True, False, True),
        (1.0, 1.5, True, True, False),
        (1.0, 1.03, True, True, True),
        (1.0, 2.5, True, False, False),
    ],
)
def test_a_small_gap_in_what_is_held_out_counts_where_nothing_was_named_or_all_strains_the_arm(
    recorded, monkeypatch, searched, held_out, named, strained, seen
):
    study = Study(*recorded(), HeldOut.ENDS, lambda line: None)
    final = study.search.climb((), study.search.parameters.start, to=1)
    final.effects = (Candidate("quadratic_drag", "joint_1", ("coefficient",)),) * named
    study.outcome = Outcome(final, study.search.starts(), 10.0)
    study.outcome.level = searched
    moved = final.fit.vector.copy()
    moved[: len(study.search.parameters.nominal)] = 5.0 * strained
    everything = dataclasses.replace(final, fit=dataclasses.replace(final.fit, vector=moved))
    monkeypatch.setattr(study, "everything", lambda: everything)
    monkeypatch.setattr(study, "foretold", lambda: SimpleNamespace(level=held_out))
    assert _has_not_seen(study) is not seen


def test_nothing_hidden_is_nothing_missing(hidden):
    found = answer(hidden["nothing"][0])
    assert found.verdict == "nothing_missing" and not found.effects


@pytest.mark.slow
def test_noise_with_colour_is_nothing_missing(tmp_path):
    (case,) = make_cases("single_link", [()], [0.0], [0], noise="coloured")
    write_case(case, tmp_path)
    found = answer(tmp_path)
    assert found.verdict == "nothing_missing"
    # the noise of a tenth of a second's rest is known roughly
    assert found.gap.after["tip_deflection_1"] < 1.3 * found.gap.noise_floor["tip_deflection_1"]


@pytest.mark.slow
def test_a_deflection_that_a_gauge_stands_for_is_followed_as_one():
    """What a gauge shows of the second mode no start, parameter or effect can imitate."""
    arm = jf.foldager_link(0.02, modes=2)
    link = dataclasses.replace(arm.links[0], deflection_from="gauge", modes=3)
    times = jnp.linspace(0.0, 1.0, 501)
    blows = Replayed(3.0 * jnp.sign(jnp.sin(40.0 * times))[:, None], 0.002)
    true = dataclasses.replace(arm, links=(link,))
    run = jf.simulate(true, blows, Step((0.0,), (0.0,)), times)
    noise = np.random.default_rng(0).normal(size=(2, 501)) * np.array([[1e-4], [2e-5]])
    channels = {
        "voltage_1": np.asarray(run["voltage_1"]),
        "angle_1": np.asarray(run["angle_1"]) + noise[0],
        "tip_deflection_1": np.asarray(run["tip_deflection_1"]) + noise[1],
    }
    recordings = [jf.Recording(np.asarray(times), channels, ())]
    file = jf.ArmFile(arm, {"default": 0.03}, None)
    gauged = by_gauge(file)
    assert gauged is not None and by_gauge(gauged) is None
    levels = []
    for known in (file, gauged):
        found = make_problem(known, recordings)
        search = Search(found.problem, found.calibration, print)
        levels.append(search.settle(search.parameters.start).level)
    assert levels[0] > 10 * levels[1]
    assert levels[1] < 3.0


def shared(*parts):
    folder = SHARED.joinpath(*parts)
    if not folder.exists():
        pytest.skip(f"needs {'/'.join(parts)} of the shared recordings, which are not here")
    return folder


@pytest.mark.slow
def test_friction_of_a_measured_axis():
    """EMPS (Janot et al. 2019): published M = 95.1 kg, Fc = 20.4 N, and an offset."""
    found = answer(shared("data", "emps"))
    assert found.effects[0].name == "coulomb_friction"
    assert found.effects[0].parameters["torque"].value == pytest.approx(20.4, rel=0.1)
    assert found.calibrated["hub_inertia"].value == pytest.approx(95.1, rel=0.05)
    assert found.gap.after["angle_1"] < 0.4 * found.gap.before["angle_1"]


@pytest.mark.slow
def test_friction_of_a_measured_flexible_link():
    """Quanser's rotary link, its deflection from a gauge at the root; by least squares, friction of 0.0175 N m."""
    found = answer(shared("data", "quanser_flexible_link"))
    assert found.effects[0].name == "coulomb_friction"
    assert 0.01 < found.effects[0].parameters["torque"].value < 0.04
    assert any("strain gauge" in note for note in found.notes)
    assert found.explained > 0.8


@pytest.mark.slow
@pytest.mark.parametrize(
    "case, names",
    [
        ("a_nothing", []),
        ("b", ["coulomb_friction"]),
        ("c", ["payload_mass"]),
        ("d", ["cable_stiffness"]),
        ("e", ["sensor_lag"]),
        ("f", ["coulomb_friction", "cable_stiffness"]),
    ],
)
def test_recordings_of_an_unrelated_simulator(case, names):
    found = answer(shared("cases", case))
    assert sorted(e.name for e in found.effects) == sorted(names)


@pytest.mark.slow
def test_two_large_effects_are_found_though_neither_helps_alone(tmp_path):
    """Together they bend the stated parameters so far that these leave less than either effect does."""
    pair = ("coulomb_friction", "cable_stiffness")
    (case,) = make_cases("single_link", [pair], [1.0], [7], typical=True)
    write_case(case, tmp_path)
    assert sorted(e.name for e in answer(tmp_path).effects) == sorted(pair)


@pytest.mark.slow
def test_a_soft_joint_shares_what_turns_between_motor_and_link(tmp_path):
    """A spring that follows at once strains the arm's parameters, which make up for the motor's share."""
    (case,) = make_cases("single_link", [("joint_flexibility",)], [1.0], [14], typical=True)
    write_case(case, tmp_path)
    found = answer(tmp_path)
    assert found.verdict == "missing_effect"
    assert [e.name for e in found.effects] == ["joint_flexibility"]
    compliance = found.effects[0].parameters["compliance"]
    assert abs(compliance.value - 0.1) < 2 * compliance.std < 0.01


def test_a_recording_without_its_input_is_refused():
    t = np.linspace(0, 2, 1001)
    recording = jf.Recording(t, {"angle_1": np.sin(t)}, ())
    arm = jf.Arm((), (jf.Joint(hub_inertia=1.0),))
    with pytest.raises(jf.RecordingError, match="torque_1"):
        diagnose(jf.ArmFile(arm, {}, None), [recording])
