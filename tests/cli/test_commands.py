import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import jaxflex as jf
from jaxflex.__main__ import app

ROOT = Path(__file__).resolve().parents[2]
LINK = str(ROOT / "experiments" / "arms" / "foldager_link.toml")


@pytest.fixture(autouse=True)
def own_cache(monkeypatch, tmp_path_factory):
    monkeypatch.setenv("JAXFLEX_CACHE", str(tmp_path_factory.getbasetemp() / "cache"))


def run(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


def test_modes_of_the_built_in_arm(tmp_path):
    result = run("modes", "--json", tmp_path / "modes.json", "-o", tmp_path)
    assert result.exit_code == 0, result.output
    found = json.loads((tmp_path / "modes.json").read_text())
    assert found["payloads"][0] == 0 and len(found["payloads"]) == 6
    assert found["driven_hz"][0][:2] == [0.0, 0.0] and found["driven_hz"][0] == sorted(found["driven_hz"][0])
    np.testing.assert_allclose(found["locked_hz"][0], jf.locked_frequencies(jf.ahmad_arm(0.0)), rtol=1e-9)
    assert len(found["clamped_hz"]) == 6 and len(found["clamped_hz"][0]) == 2
    assert (tmp_path / "modes.png").stat().st_size > 10_000
    assert "damping ratio" in result.output


def test_simulate_writes_csv_json_and_figure(tmp_path):
    result = run(
        "simulate",
        LINK,
        "--payload",
        0.01,
        "--input",
        "step",
        "--duration",
        0.2,
        "--dt",
        0.01,
        "--json",
        tmp_path / "r.json",
        "-o",
        tmp_path,
    )
    assert result.exit_code == 0, result.output
    recording = jf.read_recording(tmp_path / "run.csv")
    for name in ("angle_1", "tip_deflection_1", "tip_x", "tip_y", "voltage_1"):
        assert len(recording[name]) == 21
    assert json.loads((tmp_path / "r.json").read_text())["largest"]["angle_1"] > 0
    assert (tmp_path / "run.png").stat().st_size > 10_000
    # what it wrote drives the arm again
    again = run(
        "simulate",
        LINK,
        "--payload",
        0.01,
        "--input",
        tmp_path / "run.csv",
        "--duration",
        0.2,
        "-o",
        tmp_path / "b",
    )
    assert again.exit_code == 0, again.output


def test_tune_writes_a_design_that_simulate_loads(tmp_path):
    result = run("tune", LINK, "--payloads", "0,0.02", "--steps", 2, "-o", tmp_path)
    assert result.exit_code == 0, result.output
    found = json.loads((tmp_path / "tune.json").read_text())
    tuned = found["designs"][found["tuned"]]
    for key in ("payloads", "residual_vibration_m", "settling_time_s", "overshoot_pct", "peak_voltage_V"):
        assert len(tuned[key]) == 3
    assert {"ZV", "ZVD", "ZVDD", "EI", "PD, untuned"} <= set(found["designs"])
    page = (tmp_path / "report.html").read_text()
    assert page.count("data:image/png;base64") == 5 and "http" not in page
    assert all(part in page for part in ("What was asked", "Before and after", "The tuned design"))
    again = run("simulate", tmp_path / "tuned.toml", "-o", tmp_path / "run")
    assert again.exit_code == 0 and "its design" in again.output


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["modes", "nothing.toml"], "nothing.toml: cannot be read"),
        (["modes", "--payloads", "3:1"], "allowed are FIRST:LAST:COUNT"),
        (["modes", "--payloads=-1:1:3"], "none below 0"),
        (["modes", "--pose", "1"], "2 number(s)"),
        (["simulate", "--input", "dance"], "allowed are move, step, bang-bang or a recording"),
        (["simulate", "--input", "no.csv"], "no.csv: cannot be read"),
        (["simulate", "--dt", "0"], "a positive number of seconds"),
        (["simulate", "--duration", "-1"], "more than --dt"),
        (["simulate", "--payload", "-1"], "at least 0 kg"),
        (["tune", "--steps", "0"], "at least 1"),
        (["tune", "--duration", "0"], "a positive number of seconds"),
        (["tune", "--move", "1,2,3"], "2 number(s)"),
    ],
)
def test_bad_input_is_one_line_and_status_two(arguments, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = run(*arguments)
    assert result.exit_code == 2
    assert message in result.stderr and "Traceback" not in result.output


def test_an_arm_that_cannot_vibrate_is_not_tuned(tmp_path):
    (tmp_path / "axis.toml").write_text("[[joint]]\nhub_inertia = 1.0\n")
    result = run("tune", tmp_path / "axis.toml", "-o", tmp_path)
    assert result.exit_code == 2 and "no flexible link" in result.stderr


def test_motor_axes_have_modes_and_simulate(tmp_path):
    (tmp_path / "axis.toml").write_text("[[joint]]\nhub_inertia = 1.0\n")
    assert run("modes", tmp_path / "axis.toml").exit_code == 0
    result = run("simulate", tmp_path / "axis.toml", "--input", "bang-bang", "-o", tmp_path)
    assert result.exit_code == 0, result.output


def test_help():
    for command in ("tune", "simulate", "modes", "diagnose", "shaper"):
        assert run(command, "--help").exit_code == 0
