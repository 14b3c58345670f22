"""The noise floor that is found is the noise that was added, whatever the motion beneath."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import jaxflex as jf
from jaxflex.diagnosis.noise import noise_floor, noise_floors, resolution_of, rest_before_motion

STEP = 2e-3
NYQUIST = 0.5 / STEP


def motion(count=5000, rest=0, ringing=(3.3, 21.0, 0.3 * NYQUIST)):
    """There and back by 1 rad, ringing at the frequencies [Hz] given, after `rest` samples."""
    times = STEP * (np.arange(count) - rest)
    share = np.clip(times / 1.5, 0, 1) - np.clip((times - 4) / 1.5, 0, 1)
    angle = share**3 * (10 - 15 * share + 6 * share**2)
    for frequency in ringing:
        decay = np.exp(-0.6 * np.maximum(times, 0))
        angle += (times > 0) * 0.165 / frequency * decay * np.sin(2 * np.pi * frequency * times)
    return angle


def coloured(a, count, std, seed):
    """AR(1) noise in its steady state."""
    white = std * np.sqrt(1 - a**2) * np.random.default_rng(seed).normal(size=count)
    noise = np.empty(count)
    noise[0] = white[0] / np.sqrt(1 - a**2)
    for k in range(1, count):
        noise[k] = a * noise[k - 1] + white[k]
    return noise


@pytest.mark.parametrize("std", [1e-5, 1e-2])
@pytest.mark.parametrize("seed", range(5))
def test_white_noise_on_a_ringing_move(std, seed):
    noise = std * np.random.default_rng(seed).normal(size=5000)
    floor = noise_floor(motion() + noise)
    assert floor.std == pytest.approx(std, rel=0.06)
    assert floor.ar == () and floor.basis == "spectrum" and floor.innovation == floor.std


def test_hum_and_a_shock_hardly_raise_the_floor():
    """The hum, 14 times the noise, fills a tenth of the ordinates and shifts their median by that."""
    values = motion() + 1e-4 * np.random.default_rng(0).normal(size=5000)
    values += 2e-3 * np.sin(2 * np.pi * 150 * STEP * np.arange(5000))
    values[2000:2010] += 0.05
    assert noise_floor(values).std == pytest.approx(1e-4, rel=0.1)


@pytest.mark.parametrize("a", [-0.5, 0.5, 0.8])
@pytest.mark.parametrize("seed", range(3))
def test_rest_shows_the_colour(a, seed):
    values = motion(rest=1000) + coloured(a, 5000, 2e-4, seed)
    floor = noise_floor(values, rest=[values[:1000]])
    assert floor.basis == "spectrum and rest"
    assert floor.ar[0] == pytest.approx(a, abs=0.1)
    assert floor.std == pytest.approx(2e-4, rel=0.2)
    assert floor.innovation == pytest.approx(2e-4 * np.sqrt(1 - a**2), rel=0.1)


@pytest.mark.parametrize("seed", range(3))
def test_an_arm_that_begins_to_fall_is_not_noise_with_colour(seed):
    """A constant force moves it by 50 times the noise before its input does."""
    fallen = 5e-3 * (np.arange(5000) / 100) ** 2
    values = fallen + 1e-4 * np.random.default_rng(seed).normal(size=5000)
    floor = noise_floor(values, rest=[values[:100]])
    assert floor.ar == () and floor.std == pytest.approx(1e-4, rel=0.06)


def test_without_rest_noise_of_low_frequency_is_underestimated():
    """A limit of the method, as its docstring says."""
    floor = noise_floor(motion() + coloured(0.8, 5000, 2e-4, 0))
    assert floor.ar == () and 0.3 < floor.std / 2e-4 < 0.5


def test_white_noise_at_rest_is_seldom_called_coloured():
    rng = np.random.default_rng(0)
    named = [bool(noise_floor(v, rest=[v[:200]]).ar) for v in rng.normal(size=(100, 400))]
    assert sum(named) <= 8


@pytest.mark.parametrize("counts", [2048, 16384])
@pytest.mark.parametrize("rest", [0, 4000])
def test_an_encoder_errs_by_its_counts(counts, rest):
    count = 2 * np.pi / counts
    angle = motion(rest=rest)
    floor = noise_floor(np.round(count * np.round(angle / count), 6))
    assert floor.resolution == pytest.approx(count, rel=1e-4)
    assert floor.std == pytest.approx(count / np.sqrt(12), rel=0.06)


@pytest.mark.parametrize("share", [0.3, 1.0])
def test_noise_before_rounding_adds_to_it(share):
    count = 2 * np.pi / 4096
    angle = motion()
    noise = share * count * np.random.default_rng(3).normal(size=5000)
    shown = count * np.round((angle + noise) / count)
    assert noise_floor(shown).std == pytest.approx(np.std(shown - angle), rel=0.06)


@settings(max_examples=50)
@given(size=st.floats(1e-6, 1e3), offset=st.floats(-1, 1), seed=st.integers(0, 100))
def test_a_lattice_is_recognised_and_its_absence_too(size, offset, seed):
    counts = np.random.default_rng(seed).integers(-300, 300, size=500)
    assert resolution_of(size * (counts + offset)) == pytest.approx(size, rel=1e-6)
    assert resolution_of(size * np.random.default_rng(seed).normal(size=500)) == 0


def test_a_channel_that_never_moves_has_no_noise():
    floor = noise_floor(np.full(100, 0.3))
    assert floor.std == 0 and floor.resolution == 0


def test_short_pieces_are_refused():
    with pytest.raises(ValueError, match="found at most 20 samples; 32"):
        noise_floor(np.zeros(20), np.zeros(10))


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_rest_ends_where_the_input_moves(noise):
    times = STEP * np.arange(2000)
    rng = np.random.default_rng(4)
    voltage = np.where(times < 1, 0.0, 3 * np.sin(2 * times - 2)) + noise * rng.normal(size=2000)
    still = jf.Recording(times, {"voltage_1": voltage, "torque_1": np.zeros(2000)})
    assert rest_before_motion(still, ["voltage_1", "torque_1"]) == pytest.approx(505, abs=7)
    assert rest_before_motion(still, ["torque_1"]) == 0
    late = still.window(600, 2000)
    assert rest_before_motion(late, ["voltage_1"]) < 20


def test_floors_of_several_runs_are_one():
    rng = np.random.default_rng(5)
    runs = []
    for rest in (0, 400):
        noise = coloured(0.6, 3000, 1e-3, rest)
        times = STEP * np.arange(3000)
        channels = {
            "voltage_1": 1.0 * (np.arange(3000) >= rest) * np.cos(times),
            "current_1": motion(3000, rest) + noise,
        }
        if rest == 0:
            channels["rate_1"] = motion(3000) + 0.1 * rng.normal(size=3000)
        runs.append(jf.Recording(times, channels))
    floors = noise_floors(runs, ["voltage_1"], ["current_1", "rate_1", "strain_1"])
    assert list(floors) == ["current_1", "rate_1"]
    assert floors["current_1"].ar[0] == pytest.approx(0.6, abs=0.1)
    assert floors["current_1"].std == pytest.approx(1e-3, rel=0.15)
    assert floors["rate_1"].std == pytest.approx(0.1, rel=0.06)


def test_floors_of_the_example_recordings(shared):
    """Made with 0.01 A, 0.02 mm and 16384 counts, it seems: every run agrees on them."""
    for path in sorted(shared.glob("cases/*/run_*.csv")):
        outputs = ["current_1", "tip_deflection_1", "angle_1"]
        floors = noise_floors([jf.read_recording(path)], ["voltage_1"], outputs)
        assert floors["current_1"].std == pytest.approx(0.01, rel=0.05)
        assert floors["tip_deflection_1"].std == pytest.approx(2e-5, rel=0.05)
        assert floors["angle_1"].resolution == pytest.approx(2 * np.pi / 16384, rel=1e-4)
