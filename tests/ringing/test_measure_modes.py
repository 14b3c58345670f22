"""Modes measured from recordings of closed form, against what went into them."""

from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import lsim

import controllers as ctl
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


PLANT = [(3.1, 0.02, 1.0), (11.0, 0.015, 0.3)]  # frequency, damping ratio, share of the tip's motion
COMMANDS = {
    "step": lambda t: 1.0 * (t > 0.5),
    "move": lambda t: np.polyval([6.0, -15.0, 10.0, 0.0, 0.0, 0.0], np.clip(8 * (t - 0.5), 0, 1)),
    "square": lambda t: np.sign(np.sin(2 * np.pi * 0.4 * t)),
    "sweep": lambda t: np.sin(2 * np.pi * (0.5 + 1.2 * t) * t),
    "logarithmic sweep": lambda t: np.sin(30 * np.exp(t / 2.5)),
    "sweep that ends": lambda t: np.where(t < 5, np.sin(2 * np.pi * (0.5 + 2.4 * t) * t), 0.0),
}


def driven(command, channel, noise=0.02, seed=0, named="reference_1"):
    """The plant moved by a command, read through noise."""
    times = np.arange(0.0, 10.0, 1 / RATE)
    omega = 2 * np.pi * np.array([f for f, *_ in PLANT])
    zeta, share = np.array([z for _, z, _ in PLANT]), np.array([g for *_, g in PLANT])
    zero, eye = np.zeros((2, 2)), np.eye(2)
    a = np.block([[zero, eye], [-np.diag(omega**2), -np.diag(2 * zeta * omega)]])
    b = np.concatenate([np.zeros(2), omega**2])[:, None]
    c, d = np.concatenate([share, np.zeros(2)])[None], np.zeros((1, 1))
    if channel.startswith("tip_acceleration"):
        c, d = c @ a @ a, c @ a @ b
    inputs = COMMANDS[command](times)
    seen = lsim((a, b, c, d), inputs, times)[1].ravel()
    seen += noise * seen.std() * np.random.default_rng(seed).standard_normal(len(times))
    return jf.Recording(times, {channel: 1e-3 * seen} | ({named: inputs} if named else {}), source=command)


def assert_met(found):
    """Every mode within four of its stated deviations, and these small enough to be of use."""
    assert len(found.modes) == len(PLANT) and not found.warnings
    for mode, (f, zeta, _) in zip(sorted(found.modes, key=lambda m: m.frequency), PLANT, strict=True):
        assert abs(mode.frequency - f) < 4 * mode.frequency_std and mode.frequency_std < 2e-3 * f
        assert abs(mode.damping_ratio - zeta) < 4 * mode.damping_std and mode.damping_std < 0.1 * zeta


@pytest.mark.parametrize("channel", ["strain_1", "tip_deflection_1", "tip_acceleration_1"])
@pytest.mark.parametrize("command", COMMANDS)
def test_modes_of_driven_runs(command, channel):
    assert_met(jf.measure_modes([driven(command, channel)]))


def test_a_step_counts_as_a_decay_and_a_sweep_as_driven():
    for command, said in (("step", "1 free decay"), ("sweep", "driven throughout")):
        assert said in jf.measure_modes([driven(command, "strain_1")]).used[0]


def test_a_decay_is_found_behind_a_move_that_is_not_recorded():
    for command in ("step", "move"):
        assert_met(jf.measure_modes([driven(command, "tip_acceleration_1", named=None)]))


def test_a_motion_that_something_unknown_drives_is_said():
    found = jf.measure_modes([driven("sweep", "strain_1", named=None)])
    assert any("not recorded drives it" in warning for warning in found.warnings)


def test_stated_deviations_of_driven_runs_are_those_of_repeats():
    repeats = [jf.measure_modes([driven("sweep", "strain_1", 0.2, seed)]).modes[0] for seed in range(12)]
    values, stated = (
        np.array([[m.frequency, m.damping_ratio] for m in repeats]),
        np.mean([[m.frequency_std, m.damping_std] for m in repeats], axis=0),
    )
    assert np.all(values.std(axis=0) / stated > 0.5) and np.all(values.std(axis=0) / stated < 1.7)
    assert np.all(np.abs(values.mean(axis=0) - [3.1, 0.02]) < stated)


def test_sizes_of_driven_runs_are_those_of_a_step():
    slow = jf.measure_modes([driven("sweep", "strain_1")]).modes
    np.testing.assert_allclose([m.size for m in slow], [1 / 1.3, 0.3 / 1.3], rtol=0.01)


@pytest.fixture(scope="module")
def loop():
    """A link under PD control that follows a sweep: the arm, the controller, and its log."""
    arm = jf.load_arm(Path(__file__).resolve().parents[2] / "experiments" / "arms" / "foldager_link.toml")
    controller = ctl.PD(stiffness=3.0, damping=0.1)
    times = jnp.arange(0.0, 8.0, 1 / 500)
    sweep = ctl.Sampled(times, (0.02 * jnp.sin(2 * jnp.pi * (1.0 + 3.5 * times) * times))[:, None])
    channels = ["voltage_1", "angle_1", "tip_deflection_1", "reference_1"]
    run = jf.simulate(arm, controller, sweep, times, channels=channels, method=jf.Fixed(5e-4))
    rng = np.random.default_rng(0)
    log = {name: np.asarray(run[name]) for name in channels}
    log["tip_deflection_1"] = log["tip_deflection_1"] + 4e-6 * rng.standard_normal(len(times))
    return arm, controller, jf.Recording(np.asarray(times), log)


def test_which_modes_are_found_depends_on_what_counts_as_the_input(loop):
    arm, controller, log = loop
    pose = jnp.zeros(1)

    def ringing(law):
        modes = jf.closed_loop_modes(jf.linearise(arm, pose, law, ()))
        rings = (modes.damping_ratio < 0.6) & (modes.frequency > 0.1) & (modes.frequency < 60)
        return np.stack([modes.frequency, modes.damping_ratio], axis=1)[rings]

    truths = {
        "reference": ringing(controller),
        "voltage": ringing(ctl.PD(0.0, 0.0)),
        "angle": np.array([[jf.locked_frequencies(arm, pose)[0], arm.links[0].damping_ratio[0]]]),
    }
    for kind, truth in truths.items():
        found = jf.measure_modes([log], None if kind == "reference" else kind)
        assert all(m.frequency < 70 for m in found.modes)
        near = [min(found.modes, key=lambda m, f=f: abs(m.frequency - f)) for f, _ in truth]
        np.testing.assert_allclose([m.frequency for m in near], truth[:, 0], rtol=0.01, err_msg=kind)
        off = abs(near[0].damping_ratio - truth[0, 1])
        assert off < 0.03 * truth[0, 1] + 2 * near[0].damping_std, kind
        assert any("Record reference_1" in w for w in found.warnings) == (kind != "reference")
    unnamed = jf.Recording(log.times, {k: v for k, v in log.channels.items() if k != "reference_1"})
    assert any("moved by its drive (voltage)" in w for w in jf.measure_modes([unnamed]).warnings)


def test_a_silent_recording_is_left_out_and_an_input_that_is_not_there_named():
    found = jf.measure_modes([decay([], noise=1.0), decay([(3.0, 0.02, 1.0, 0.3)])])
    assert found.modes[0].recordings == 1 and any(w.startswith("left out") for w in found.warnings)
    with pytest.raises(jf.RecordingError, match="no channel voltage_1 that changes"):
        jf.measure_modes([driven("sweep", "strain_1")], "voltage")
    with pytest.raises(jf.RecordingError, match="allowed are reference"):
        jf.measure_modes([driven("sweep", "strain_1")], "wind")


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
    recording = jf.read_recording(path)
    found = jf.measure_modes([recording])
    assert "driven throughout" in found.used[0]
    assert 1.0 < found.modes[0].frequency < 4.0 and 0.2 < found.modes[0].damping_ratio < 0.6
    # with the hub's angle given it is the link alone, whose resonance others put between 3.0 and 3.4 Hz
    link = jf.measure_modes([recording], "angle").modes[0]
    assert 3.0 < link.frequency < 3.4 and link.damping_ratio < 0.03


def test_recordings_of_another_making(shared):
    # a controller whose reference is not logged, and dry friction in the joint: its angle is what is left
    folder = shared / "cases" / "b"
    if not folder.is_dir():
        pytest.skip(f"recordings are not here: {folder} is absent")
    found = jf.measure_modes([jf.read_recording(folder / "run_2.csv")])
    locked = jf.locked_frequencies(jf.load_arm(folder / "arm.toml"), jnp.zeros(1))[0]
    np.testing.assert_allclose(found.modes[0].frequency, locked, rtol=0.03)
