"""What is hidden in the blind data, and how large it is there."""

import numpy as np
import pytest

from experiments.blind.drive import record
from experiments.blind.effects import EFFECTS, available
from experiments.blind.gaps import floor, measure
from experiments.blind.make import make_cases, with_peaks, write_case
from experiments.blind.outside import CATALOGUE
from experiments.blind.rigs import NOISE, true_rig
from experiments.blind.sizes import COARSE, hide
from experiments.blind.typical import TYPICAL
from jaxflex.files import arm_file, read_recording

pytestmark = pytest.mark.optimised


@pytest.mark.parametrize("plant", ["single_link", "two_link", "axis"])
def test_every_effect(plant):
    """At size zero it changes nothing, at its usual size something that the noise would not hide."""
    rig = with_peaks([true_rig(plant, "effects")])[0]
    names = list(available(plant))
    rigs = [rig.copy() for _ in range(2 * len(names))]
    for name, absent, present in zip(names, rigs[::2], rigs[1::2], strict=True):
        hide(absent, "effects", name, 0.0)
        hide(present, "effects", name, EFFECTS[name].guess)
    _, read, _ = record([rig, *rigs], COARSE)
    for n, name in enumerate(names):
        absent, present = ((read[:, :, :, 1 + 2 * n + k] - read[:, :, :, 0]) for k in (0, 1))
        np.testing.assert_allclose(absent, 0.0, rtol=0, atol=1e-9, err_msg=name)
        rms = np.sqrt(np.mean(present**2, axis=(0, -1))) / floor(rig)
        assert rms.max() > 0.3, name


def test_a_parameter_within_its_uncertainty_leaves_no_gap():
    rig = true_rig("single_link", "fit")
    moved = rig.copy()
    moved.body["payload_mass"] *= 1.04
    gap = measure([rig], [moved], COARSE)[0][0]
    assert max(gap.raw.values()) > 10.0
    assert gap.size < 0.1


def test_what_brings_parameters_back_to_their_nominal_values_leaves_no_gap():
    """Twenty standard deviations from the plant without it, none from what the arm file says."""
    rig = true_rig("axis", "fit")
    rig.body["hub_inertia"] = rig.body["hub_inertia"] * 1.6
    moved = rig.copy()
    moved.body["hub_inertia"] = moved.body["hub_inertia"] / 1.6
    assert measure([rig], [moved], COARSE)[0][0].size < 0.2
    assert measure([moved], [rig], COARSE)[0][0].size > 3.0


def test_cases_are_as_asked(tmp_path, monkeypatch):
    monkeypatch.setattr("experiments.blind.make.FINE", COARSE)
    wanted = [("coulomb_friction",), ("sensor_lag",), ()]
    cases = make_cases("single_link", wanted, [3.0], [0])
    assert [c.name for c in cases] == ["coulomb_friction-3-0", "sensor_lag-3-0", "nothing-0"]
    for case in cases[:2]:
        assert case.gap["size"] == pytest.approx(3.0, rel=0.15)
        assert case.truth[0][0] in CATALOGUE
    assert cases[2].truth == ()
    assert cases[2].gap["size"] < 0.05
    write_case(cases[0], tmp_path)
    assert arm_file.read_arm_file(tmp_path / "arm.toml").arm.joints[0].motor is not None
    log = read_recording.read_recording(tmp_path / "run_2.csv")
    assert set(log.channels) == {"voltage_1", "angle_1", "current_1", "tip_deflection_1"}
    assert log.repairs == ()
    difference = np.diff(log["current_1"], 4)[100:]
    assert difference.std() / 70**0.5 == pytest.approx(NOISE["current"], rel=0.1)
    again = make_cases("single_link", [wanted[2]], [], [0], also=("rate", "strain"))[0]
    np.testing.assert_array_equal(again.runs[0]["current_1 [A]"], cases[2].runs[0]["current_1 [A]"])
    assert {"rate_1 [rad/s]", "strain_1 [1]"} <= set(again.runs[0])


def test_typical_sizes_are_of_effects_that_can_be_hidden(monkeypatch):
    monkeypatch.setattr("experiments.blind.make.FINE", COARSE)
    assert TYPICAL.keys() == EFFECTS.keys()
    (case,) = make_cases("single_link", [("coulomb_friction",)], [0.5], [0], typical=True)
    assert case.truth == (("coulomb_friction", "joint_1", {"torque": 0.5 * TYPICAL["coulomb_friction"]}),)
    assert case.gap["wanted"] is None
    assert case.gap["size"] > 100
