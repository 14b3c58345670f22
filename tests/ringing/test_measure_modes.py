"""Modes measured from recordings of closed form, against what went into them."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import jaxflex as jf

RATE = 400.0  # Hz


def waves(modes, times):
    """Decaying sines: `(frequency, damping ratio, amplitude, phase)` each."""
    total = np.zeros_like(times)
    for f, zeta, amplitude, phase in modes:
        omega = 2 * np.pi * f
        total += (
            amplitude * np.exp(-zeta * omega * times) * np.cos(omega * np.sqrt(1 - zeta**2) * times + phase)
        )
    return total


def decay(modes, noise=0.02, seconds=4.0, seed=0, channel="strain_1", offset=0.7):
    times = np.arange(0.0, seconds, 1 / RATE)
    values = offset + waves(modes, times) + noise * np.random.default_rng(seed).standard_normal(len(times))
    return jf.Recording(times, {channel: 1e-4 * values})


def oscillator(times, drive, f, zeta, friction=0.0, start=(0.0, 0.0)):
    omega = 2 * np.pi * f

    def slope(t, x):
        rub = friction * np.tanh(50 * x[1])
        return [x[1], -(omega**2) * (x[0] - np.interp(t, times, drive)) - 2 * zeta * omega * x[1] - rub]

    return solve_ivp(slope, (0, times[-1]), start, t_eval=times, rtol=1e-7, atol=1e-9, max_step=5e-3).y[0]


@pytest.mark.parametrize("channel", ["strain_1", "tip_deflection_1", "tip_acceleration_2"])
def test_a_clean_decay_is_met_to_rounding(channel):
    found = jf.measure_modes([decay([(3.0, 0.02, 1.0, 0.3), (17.0, 0.01, 0.3, 1.0)], 0.0, channel=channel)])
    assert len(found.modes) == 2 and not found.warnings
    for mode, (f, zeta) in zip(found.modes, ((3.0, 0.02), (17.0, 0.01)), strict=True):
        np.testing.assert_allclose([mode.frequency, mode.damping_ratio], [f, zeta], rtol=1e-7)


def test_stated_deviations_are_those_of_repeats():
    repeats = [jf.measure_modes([decay([(3.0, 0.02, 1.0, 0.3)], 0.1, seed=s)]).modes[0] for s in range(24)]
    for name, true in (("frequency", 3.0), ("damping_ratio", 0.02)):
        values = np.array([getattr(mode, name) for mode in repeats])
        stated = np.mean([getattr(mode, name.replace("_ratio", "") + "_std") for mode in repeats])
        assert 0.6 < values.std() / stated < 1.6
        assert abs(values.mean() - true) < 4 * stated / np.sqrt(len(values))


@pytest.mark.parametrize("close", [(3.0, 3.5), (3.0, 19.0)])
def test_two_modes_in_noise(close):
    modes = [(close[0], 0.01, 1.0, 0.3), (close[1], 0.012, 0.4, 1.0)]
    found = jf.measure_modes([decay(modes, 0.05, seconds=6.0)]).modes
    np.testing.assert_allclose([m.frequency for m in found], close, rtol=2e-3)
    for mode, (_, zeta, *_) in zip(found, modes, strict=True):
        assert abs(mode.damping_ratio - zeta) < 4 * mode.damping_std + 1e-5


def test_two_channels_share_their_modes():
    one, two = decay([(3.0, 0.02, 1.0, 0.3)]), decay([(3.0, 0.02, 0.2, 2.0), (11.0, 0.03, 1.0, 0.0)], seed=1)
    both = jf.Recording(one.times, {"strain_1": one["strain_1"], "strain_2": two["strain_1"]})
    np.testing.assert_allclose(
        sorted(m.frequency for m in jf.measure_modes([both]).modes), [3.0, 11.0], rtol=2e-3
    )


def test_a_step_is_fitted_as_a_decay_and_a_sweep_with_its_input():
    times = np.arange(0.0, 6.0, 1 / RATE)
    noise = 0.02 * np.random.default_rng(3).standard_normal(len(times))
    step = (times > 0.5) * 1.0
    sweep = np.sin(2 * np.pi * (0.5 * times + 19.5 / 12 * times**2))
    for name, drive, said in (
        ("reference_1", step, "1 free decay"),
        ("voltage_1", sweep, "driven throughout"),
    ):
        seen = 0.01 * (oscillator(times, drive, 3.0, 0.03) + noise)
        found = jf.measure_modes([jf.Recording(times, {name: drive, "tip_deflection_1": seen})])
        assert said in found.used[0]
        np.testing.assert_allclose(found.modes[0].frequency, 3.0, rtol=1e-3)
        np.testing.assert_allclose(found.modes[0].damping_ratio, 0.03, rtol=0.02)


def test_recordings_that_differ_widen_the_spread_and_are_named():
    found = jf.measure_modes([decay([(3.0, 0.02, 1.0, 0.3)]), decay([(2.6, 0.03, 1.0, 0.3)], seed=1)])
    mode = found.modes[0]
    assert mode.recordings == 2 and mode.frequency_range[0] < 2.6 and mode.frequency_range[1] > 3.0
    assert mode.damping_range[0] < 0.02 and mode.damping_range[1] > 0.03
    assert any("from 2.6 to 3 Hz" in warning for warning in found.warnings)


def test_friction_shows_as_damping_that_changes():
    times = np.arange(0.0, 6.0, 1 / RATE)
    rubbed = oscillator(times, np.zeros_like(times), 3.0, 0.005, friction=8.0, start=(1.0, 0.0))
    noise = 0.003 * np.random.default_rng(0).standard_normal(len(times))
    found = jf.measure_modes([jf.Recording(times, {"tip_deflection_1": 0.01 * (rubbed + noise)})])
    np.testing.assert_allclose(found.modes[0].frequency, 3.0, rtol=0.01)
    assert any("changes with amplitude" in w and "friction" in w for w in found.warnings)
    plain = jf.measure_modes([decay([(3.0, 0.02, 1.0, 0.3)])])
    assert not any("amplitude" in w for w in plain.warnings)


def test_poor_data_is_said():
    short = jf.measure_modes([decay([(3.0, 0.02, 1.0, 0.3)], seconds=1.2)])
    assert any("cycles" in w for w in short.warnings)
    noisy = jf.measure_modes([decay([(3.0, 0.02, 1.0, 0.3)], 0.4)])
    assert any("the rest is noise" in w for w in noisy.warnings)
    coarse = jf.measure_modes([decay([(90.0, 0.002, 1.0, 0.3)])])
    assert any("samples a cycle" in w for w in coarse.warnings)
    gap = decay([(3.0, 0.02, 1.0, 0.3)])
    gap = jf.Recording(gap.times, gap.channels, ("time jumps",))
    assert any("time jumps" in w for w in jf.measure_modes([gap]).warnings)


@pytest.mark.parametrize(
    "recording, message",
    [
        (decay([], noise=1.0), "nothing rings"),
        (
            jf.Recording(np.arange(100) / 100, {"angle_1": np.arange(100.0)}),
            "no channel that shows vibration",
        ),
        (jf.Recording(np.arange(100) / 100, {"strain_1": np.zeros(100)}), "not constant"),
        (jf.Recording(np.arange(20) / 100, {"strain_1": np.sin(np.arange(20.0))}), "at least 40"),
        (decay([], noise=1e-9, offset=0.0).to_uniform(), "nothing rings"),
    ],
)
def test_what_does_not_ring_is_an_error(recording, message):
    with pytest.raises(jf.RecordingError, match=message):
        jf.measure_modes([recording])


@pytest.mark.slow
def test_measured_flexible_link(shared):
    path = shared / "data" / "quanser_flexible_link" / "run_1.csv"
    if not path.is_file():
        pytest.skip(f"measured data is not here: {path} is absent")
    # the hub follows a square wave under feedback: what rings is the closed loop, heavily damped
    found = jf.measure_modes([jf.read_recording(path)])
    assert "driven throughout" in found.used[0]
    assert 1.0 < found.modes[0].frequency < 4.0 and 0.2 < found.modes[0].damping_ratio < 0.6
