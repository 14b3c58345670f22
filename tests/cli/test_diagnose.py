import dataclasses
import json
import math
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import jaxflex as jf
from jaxflex.__main__ import app
from jaxflex.cli import words
from jaxflex.cli.diagnose import show, write
from jaxflex.cli.diagnosis_tables import far_moved, gap_table
from jaxflex.diagnosis.locate import LatentForce
from jaxflex.diagnosis.result import VERDICTS, Comparison, Diagnosis, Estimate, Gap, NamedEffect, Place
from jaxflex.effects import CoulombFriction
from jaxflex.files.tables import write_series
from jaxflex.plotting_diagnosis import VIEWS, plot_force, plot_force_spectrum, plot_gap

ROOT = Path(__file__).resolve().parents[2]
FRICTION, FREQUENCY = 0.01, 12.0  # N m, Hz

COULOMB = NamedEffect(
    "coulomb_friction", "joint_1", {"torque": Estimate(FRICTION, 2e-4, "N m")}, 812.0, "a torque that jumps"
)
BIAS = NamedEffect("sensor_bias", "angle_1", {"bias": Estimate(0.02, 1e-3, "rad")}, 790.0, "a steady error")


def force(size):
    """A Coulomb step in the speed and a wave in time that has nothing to do with it."""
    times = np.arange(0.005, 10, 0.01)
    rate = 2 * np.cos(2 * np.pi * 0.4 * times)
    values = -size * np.sign(rate) + 0.5 * size * np.sin(2 * np.pi * FREQUENCY * times)
    angle, acceleration = np.cumsum(rate) * 0.01, np.gradient(rate, times)
    return LatentForce("joint_1", "N m", times, values, 900.0, angle, rate, acceleration)


def diagnosis(verdict):
    """A diagnosis by hand, with every part that the verdict has."""
    arm = jf.foldager_link()
    missing = verdict != "nothing_missing"
    times = np.linspace(0, 2, 201)
    wave = {"angle_1": np.sin(times), "strain_1": 1e-4 * np.cos(times)}
    off = {name: 1.1 * values for name, values in wave.items()}
    floor = {"angle_1": 0.01, "strain_1": 1e-6}
    before = {"angle_1": 0.19, "strain_1": 2e-5} if missing else floor
    return Diagnosis(
        verdict=verdict,
        effects=(COULOMB,) if missing else (),
        alternatives=(BIAS,) if verdict == "ambiguous" else (),
        where=(Place("angle_1", "joint_1", "speed reversals", 0.83),) if missing else (),
        gap=Gap("root mean square error", True, before, {"angle_1": 0.011, "strain_1": 1.1e-6}, floor),
        next_experiment="Turn slower.",
        calibrated={"length": Estimate(2.0 * float(arm.links[0].length), 1e-3, "m")},
        improved=dataclasses.replace(arm, effects=(CoulombFriction(FRICTION, location="joint_1"),)),
        explained=0.999 if missing else 0.0,
        notes=("run_1.csv: 3 rows with NaN left out",),
        seconds=31.0,
        forces_before=(force(FRICTION),),
        forces_after=(dataclasses.replace(force(0.0), equation="voltage_1"), force(FRICTION / 50)),
        comparison=Comparison(times, wave, off, wave),
    )


@pytest.fixture
def file(tmp_path):
    jf.save_arm(jf.foldager_link(), tmp_path / "arm.toml", {"default": 0.02})
    return jf.read_arm_file(tmp_path / "arm.toml")


@pytest.mark.parametrize("verdict", VERDICTS)
def test_json_has_the_keys_that_scripts_rely_on(verdict, tmp_path, file):
    write(diagnosis(verdict), file, ["run_1.csv"], tmp_path)
    found = json.loads((tmp_path / "report.json").read_text())
    types = {
        "verdict": str, "effects": list, "alternatives": list, "where": list, "gap": dict,
        "next_experiment": str, "calibrated": dict, "seconds": float,
    }  # fmt: skip
    for key, kind in types.items():
        assert isinstance(found[key], kind), key
    assert found["verdict"] == verdict
    for effect in (*found["effects"], *found["alternatives"]):
        assert effect["name"] in jf.EFFECTS and isinstance(effect["location"], str)
        assert math.isfinite(effect["evidence"])
        for parameter in effect["parameters"].values():
            assert math.isfinite(parameter["value"]) and parameter["std"] >= 0 and parameter["unit"]
    for place in found["where"]:
        assert set(place) == {"channel", "equation", "regime", "share"} and 0 <= place["share"] <= 1
    gap = found["gap"]
    assert isinstance(gap["metric"], str) and gap["held_out"] is True
    assert gap["before"].keys() == gap["after"].keys() == gap["noise_floor"].keys()
    assert all(v > 0 for part in ("before", "after", "noise_floor") for v in gap[part].values())
    assert all(math.isfinite(p["value"]) and p["std"] > 0 for p in found["calibrated"].values())


@pytest.mark.parametrize("verdict", VERDICTS)
def test_report_stands_alone_and_says_the_verdict(verdict, tmp_path, file):
    found = diagnosis(verdict)
    write(found, file, ["run_1.csv"], tmp_path)
    page = (tmp_path / "report.html").read_text()
    assert page.count("data:image/png;base64") == 1 + 2 + len(VIEWS) + 1  # gap, channels, forces, spectrum
    assert "http" not in page and "prefers-color-scheme: dark" in page and "width=device-width" in page
    for sentence in (words.MEANING[verdict], "Turn slower.", "3 rows with NaN left out"):
        assert sentence in page
    assert ("Coulomb friction at joint 1" in page) == (verdict != "nothing_missing")
    assert ("sensor bias" in page) == (verdict == "ambiguous")
    assert not re.search(r"\bnan\b|coulomb_friction|joint_1", page)


def test_improved_arm_loads_again_with_its_effect(tmp_path, file):
    write(diagnosis("missing_effect"), file, ["run_1.csv"], tmp_path)
    again = jf.read_arm_file(tmp_path / "improved.toml")
    assert [(e.name, e.location) for e in again.arm.effects] == [("coulomb_friction", "joint_1")]
    assert float(again.arm.effects[0].torque) == FRICTION and again.uncertainty == {"default": 0.02}


def test_the_answer_in_words():
    answers = {verdict: " ".join(words.answer(diagnosis(verdict))) for verdict in VERDICTS}
    assert answers["missing_effect"].startswith("The model lacks Coulomb friction at joint 1. Size: torque")
    assert "more than 99 % of the gap" in answers["missing_effect"]
    assert (
        "joint angle 1 goes from" not in answers["missing_effect"]
    )  # the strain was worse: 20 times its noise
    assert "strain 1 goes from 20 to 1.1 times" in answers["missing_effect"]
    assert "or else sensor bias in the reading of joint angle 1" in answers["ambiguous"]
    assert "no effect in the catalogue" in answers["unexplained"] and "lacks" not in answers["unexplained"]
    assert (
        answers["nothing_missing"].startswith("Nothing is missing")
        and "1.0 times" in answers["nothing_missing"]
    )


@pytest.mark.parametrize(
    "value, std, unit, text",
    [
        (0.010123, 0.000214, "N m", "0.01012 ± 0.00021 N m"),
        (7.93e10, 2.1e9, "Pa", "(7.93 ± 0.21)×10¹⁰ Pa"),
        (9.988e-5, 2.19e-6, "kg m^2", "(9.99 ± 0.22)×10⁻⁵ kg m²"),
        (0.0, 3.2, "1", "0.0 ± 3.2"),
        (2600.0, 64.0, "", "2600 ± 64 "),
        (0.05, 0.0, "rad/s", "0.05 rad/s (held)"),
    ],
)
def test_a_value_is_as_long_as_its_standard_deviation_allows(value, std, unit, text):
    assert words.estimate(Estimate(value, std, unit)) == text


def test_what_is_printed(file, capsys):
    show(diagnosis("ambiguous"), file)
    printed = capsys.readouterr().out
    for text in (
        "Added to the model",
        "As good in its place",
        "speed reversals",
        "Turn slower.",
        "NaN left out",
    ):
        assert text in printed
    assert "Moved by more than 3 stated standard deviations: length (+50.0)" in printed


def test_parameters_within_their_uncertainty_are_not_warned_of(file):
    length = Estimate(1.01 * float(file.arm.links[0].length), 1e-3, "m")
    assert (
        far_moved(dataclasses.replace(diagnosis("missing_effect"), calibrated={"length": length}), file) == ""
    )


def test_gap_table_divides_by_the_floor():
    rows = gap_table(diagnosis("missing_effect")).rows
    assert list(rows[0]) == ["joint angle 1", "rad", "0.190", "0.0110", "0.0100", "19.0", "1.10"]


def test_pictures_show_the_step_the_line_and_the_floor():
    before, after = force(FRICTION), force(FRICTION / 50)
    axis = plot_force(VIEWS["speed"], before, after).axes[0]
    middle, mean = next(line for line in axis.lines if line.get_label() == "before").get_data()
    np.testing.assert_allclose(np.nanmean(mean[middle < -0.3]), FRICTION, rtol=0.1)
    np.testing.assert_allclose(np.nanmean(mean[middle > 0.3]), -FRICTION, rtol=0.1)
    labels = [text.get_text() for text in plot_force_spectrum(before, after).axes[0].texts]
    assert {"0.4 Hz", f"{FREQUENCY:.1f} Hz"} <= set(labels)  # the motion's and the wave's
    axis = plot_gap(diagnosis("missing_effect").gap).axes[0]
    widths = sorted(bar.get_width() for bar in axis.patches)
    np.testing.assert_allclose(widths, [1.1, 1.1, 19.0, 20.0])
    assert axis.get_xscale() == "log" and any(np.allclose(line.get_xdata(), 1.0) for line in axis.lines)


def test_a_force_that_ran_away_does_not_hide_the_other():
    wild = dataclasses.replace(force(FRICTION), values=1e12 * force(FRICTION).values)
    low, high = plot_force(VIEWS["speed"], force(FRICTION), wild).axes[0].get_ylim()
    assert -0.2 < low < -FRICTION < FRICTION < high < 0.2


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["no.toml", "run.csv"], "no.toml: cannot be read"),
        (["arm.toml", "no.csv"], "no.csv: cannot be read"),
        (["arm.toml", "run.csv"], "voltage_1: missing"),
        (["arm.toml"], "RUN"),
    ],
)
def test_bad_input_is_one_line_and_status_two(arguments, message, tmp_path, monkeypatch, file):
    monkeypatch.chdir(tmp_path)
    write_series("run.csv", np.linspace(0, 1, 501), {"angle_1": np.sin(np.linspace(0, 9, 501))})
    result = CliRunner().invoke(app, ["diagnose", *arguments])
    assert result.exit_code == 2
    assert message in result.stderr and "Traceback" not in result.output


@pytest.mark.slow
def test_from_recordings_to_an_arm_that_predicts_them(tmp_path):
    """A motor axis with Coulomb friction hidden in it; the readings have noise of known size."""
    (tmp_path / "arm.toml").write_text(
        "[[joint]]\nhub_inertia = 1e-3\nviscous_friction = 2e-3\n[drive]\ninput = 'torque'\n"
    )
    times = np.arange(0, 6, 0.002)
    noise = 1e-4
    for seed in (1, 2):
        rng = np.random.default_rng(seed)
        torque = 0.04 * np.sin(2 * np.pi * (0.4 + 0.1 * seed) * times) + 0.01 * np.sin(11 * times)
        angle = axis_with_friction(torque, 0.002, 1e-3, 2e-3, FRICTION)
        angle += noise * rng.standard_normal(len(times))
        write_series(tmp_path / f"run_{seed}.csv", times, {"torque_1": torque, "angle_1": angle})
    files = [str(tmp_path / name) for name in ("arm.toml", "run_1.csv", "run_2.csv")]
    same = tmp_path / "same.json"
    program = [sys.executable, "-m", "jaxflex", "diagnose", *files, "-o", str(tmp_path / "d")]
    environment = os.environ | {"JAXFLEX_CACHE": str(tmp_path / "cache")}
    result = subprocess.run(
        [*program, "--json", str(same)],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    assert "Coulomb friction" in result.stdout
    found = json.loads((tmp_path / "d" / "report.json").read_text())
    assert found == json.loads(same.read_text())
    assert found["effects"][0]["name"] == "coulomb_friction"
    assert found["gap"]["after"]["angle_1"] < 0.05 * found["gap"]["before"]["angle_1"]
    np.testing.assert_allclose(found["gap"]["noise_floor"]["angle_1"], noise, rtol=0.1)
    improved = jf.load_arm(tmp_path / "d" / "improved.toml")
    friction = next(e for e in improved.effects if e.name == "coulomb_friction")
    np.testing.assert_allclose(float(friction.torque), FRICTION, rtol=0.02)


def axis_with_friction(torque, step, inertia, viscous, coulomb, substeps=100):
    """Angle of an axis under a torque held between samples, with friction that truly sticks, by impulses."""
    h, angle, rate, angles = step / substeps, 0.0, 0.0, []
    for held in torque:
        angles.append(angle)
        for _ in range(substeps):
            free = rate + h * (held - viscous * rate) / inertia
            rate_after = math.copysign(max(abs(free) - h * coulomb / inertia, 0.0), free)
            angle += h * (rate + rate_after) / 2
            rate = rate_after
    return np.array(angles)
