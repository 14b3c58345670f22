"""`jaxflex shaper`, from recordings and from arms, end to end."""

import json
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.signal import lsim
from typer.testing import CliRunner

import controllers as ctl
import jaxflex as jf
from jaxflex.__main__ import app
from jaxflex.files.tables import write_series

LINK = Path(__file__).resolve().parents[2] / "experiments" / "arms" / "foldager_link.toml"


@pytest.fixture(autouse=True)
def own_cache(monkeypatch, tmp_path_factory):
    monkeypatch.setenv("JAXFLEX_CACHE", str(tmp_path_factory.getbasetemp() / "cache"))


def run(*arguments):
    return CliRunner().invoke(app, ["shaper", *(str(a) for a in arguments)])


def decay(path, modes, noise=0.02, seed=0):
    """A file of decaying sines `(frequency, damping ratio, amplitude)` with noise."""
    times = np.arange(0.0, 4.0, 1 / 400)
    values = noise * np.random.default_rng(seed).standard_normal(len(times))
    for f, zeta, amplitude in modes:
        omega = 2 * np.pi * f
        values += amplitude * np.exp(-zeta * omega * times) * np.cos(omega * np.sqrt(1 - zeta**2) * times)
    write_series(path, times, {"strain_1": 1e-4 * values})
    return path


def test_recordings_become_a_shaper_that_the_library_reads(tmp_path):
    runs = [
        decay(tmp_path / "a.csv", [(3.0, 0.02, 1.0)]),
        decay(tmp_path / "b.csv", [(2.7, 0.03, 1.0)], seed=1),
    ]
    result = run(*runs, "--json", tmp_path / "r.json", "-o", tmp_path)
    assert result.exit_code == 0, result.output
    found = json.loads((tmp_path / "r.json").read_text())
    low, high = found["modes"][0]["frequency_range_hz"]
    assert low < 2.7 and 3.0 < high < 3.02
    # what is written is the shaper that was recommended, and does what is claimed of it
    shaper = ctl.load_shaper(tmp_path / "shaper.toml")
    best = found["shapers"][found["recommended"]]
    np.testing.assert_allclose(shaper.delays, best["delays_s"], rtol=1e-12)
    np.testing.assert_allclose(shaper.amplitudes, best["amplitudes"], rtol=1e-12)
    again = eval(best["python"], {"ctl": ctl, "jnp": jnp})  # the line that is offered for pasting
    np.testing.assert_allclose(again.delays, shaper.delays, rtol=1e-3)
    for f in np.linspace(2.7, 3.0, 7):
        assert ctl.residual_ratio(shaper, f, 0.025) <= best["worst_residual"] * (1 + 1e-6)
    # nothing shorter, of positive impulses, holds the tolerance
    assert best["worst_residual"] <= 0.05
    for name, other in found["shapers"].items():
        if not name.startswith("UM") and other["added_time_s"] < 0.98 * best["added_time_s"]:
            assert other["worst_residual"] > 0.05
    assert found["reason"] in " ".join(result.output.split())
    assert any("recordings put one mode" in warning for warning in found["warnings"])
    page = (tmp_path / "report.html").read_text()
    assert "data:image/png;base64" in page and "[shaper]" in page and "http" not in page
    assert (tmp_path / "shaper.png").stat().st_size > 20_000


def test_a_second_mode_brings_shapers_for_both(tmp_path):
    both = decay(tmp_path / "a.csv", [(3.0, 0.02, 1.0), (8.0, 0.01, 0.5)])
    assert run(both, "-o", tmp_path, "--tolerance", 0.02).exit_code == 0
    found = json.loads((tmp_path / "shaper.json").read_text())
    assert [round(mode["frequency_hz"], 1) for mode in found["modes"]] == [3.0, 8.0]
    for name in ("ZV x ZV", "ZVD x ZVD", "two modes together"):
        assert found["shapers"][name]["worst_residual"] < 0.01
    assert found["shapers"]["ZV"]["worst_residual_by_mode"][1] > 0.1


def test_a_driven_recording_says_what_its_modes_are_of(tmp_path):
    times = np.arange(0.0, 8.0, 1 / 400)
    command = np.sin(2 * np.pi * (0.5 + 1.2 * times) * times)
    omega, zeta = 2 * np.pi * 3.0, 0.03
    plant = ([omega**2], [1.0, 2 * zeta * omega, omega**2])
    seen = lsim(plant, command, times)[1] + 0.02 * np.random.default_rng(0).standard_normal(len(times))
    write_series(tmp_path / "a.csv", times, {"voltage_1": command, "tip_deflection_1": 1e-3 * seen})
    result = run(tmp_path / "a.csv", "-o", tmp_path)
    assert result.exit_code == 0, result.output
    (mode,) = json.loads((tmp_path / "shaper.json").read_text())["modes"]
    np.testing.assert_allclose([mode["frequency_hz"], mode["damping_ratio"]], [3.0, zeta], rtol=0.01)
    assert "moved by its drive (voltage)" in " ".join(result.output.split())


def test_the_model_over_payloads(tmp_path):
    result = run(LINK, "--payloads", "0.01:0.04:3", "-o", tmp_path)
    assert result.exit_code == 0, result.output
    found = json.loads((tmp_path / "shaper.json").read_text())
    arm = jf.load_arm(LINK)
    middle = arm.with_payload(0.025)
    pose = jnp.stack(ctl.default_move(middle).stop)
    f, zeta = ctl.ringing_mode(middle, pose, ctl.textbook_pd(middle, pose))
    low, high = found["modes"][0]["frequency_range_hz"]
    assert low <= f <= high
    low, high = found["modes"][0]["damping_ratio_range"]
    assert low <= zeta <= high
    assert ctl.load_shaper(tmp_path / "shaper.toml").delays[0] == 0


def test_bad_input_is_one_line_and_status_two(tmp_path):
    dull = tmp_path / "dull.csv"
    write_series(dull, np.arange(100) / 100, {"angle_1": np.sin(np.arange(100.0))})
    good = decay(tmp_path / "a.csv", [(3.0, 0.02, 1.0)])
    for arguments, message in (
        (["no.csv"], "no.csv: cannot be read"),
        (["no.toml"], "no.toml: cannot be read"),
        ([dull], "no channel that shows vibration"),
        ([decay(tmp_path / "n.csv", [], 1.0)], "nothing rings"),
        ([LINK, good], "an arm and recordings"),
        ([LINK, LINK], "2 arms"),
        ([good, "--payloads", "0:1:2"], "with an arm only"),
        ([good, "--tolerance", 2], "--tolerance 2"),
        ([good, "--input", "wind"], "--input wind: allowed are reference"),
        ([good, "--input", "voltage"], "no channel voltage_1 that changes"),
        ([LINK, "--input", "angle"], "with recordings only"),
    ):
        result = run(*arguments)
        assert result.exit_code == 2, arguments
        assert message in result.stderr and "Traceback" not in result.output
        assert result.stderr.count("\n") == 1


@pytest.mark.parametrize(
    "text, message",
    [
        ("", r"no table \[shaper\]"),
        ("[shaper]\namplitudes = [1.0]", "delays: found None"),
        ("[shaper]\namplitudes = [1.0]\ndelays = [0.0, 1.0]", "as many"),
        ("[shaper]\namplitudes = [0.5, 0.4]\ndelays = [0.0, 1.0]", "sum to 0.9"),
        ("[shaper]\namplitudes = [0.5, 0.5]\ndelays = [0.1, 1.0]", "rising from 0"),
        ("[shaper", "cannot be read"),
    ],
)
def test_a_shaper_file_that_is_none(text, message, tmp_path):
    (tmp_path / "s.toml").write_text(text)
    with pytest.raises(ValueError, match=message):
        ctl.load_shaper(tmp_path / "s.toml")


def test_recommendation_without_a_shaper_that_will_do():
    wide = jf.MeasuredMode(3.0, 0.1, 0.01, 0.001, (1.0, 5.0), (0.01, 0.01), 1.0, 2)
    rated = ctl.rate_shapers([wide])
    best, why = ctl.recommend(rated, 1e-3)
    assert "no shaper leaves" in why
    assert best.worst <= 1.01 * min(r.worst for r in rated if r.name not in ctl.ALTERNATING)
    assert jax.tree_util.tree_all(
        jax.tree_util.tree_map(lambda x: bool(jnp.all(jnp.isfinite(x))), best.shaper)
    )
