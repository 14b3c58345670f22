import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from controllers import OpenLoop
from jaxflex.diagnosis.calibrate import Freedom, fit
from jaxflex.diagnosis.delay import delayed
from jaxflex.diagnosis.hypothesis import Search
from jaxflex.diagnosis.plant import respond
from jaxflex.diagnosis.prepare import make_problem
from jaxflex.files.arm_file import ArmFile

DT, SAMPLES = 0.004, 400


class Held(jf.AbstractReference):
    """A command held between samples."""

    values: jnp.ndarray

    def __call__(self, t):
        index = jnp.clip(jnp.floor(t / DT + 1e-6).astype(int), 0, SAMPLES - 1)
        return (self.values[index],)

    def jumps(self):
        return jnp.arange(1, SAMPLES) * DT

    def end(self):
        return jnp.asarray(SAMPLES * DT)


def nominal():
    motor = jf.DCMotor(1.2, 0.06, 0.06, inductance=3e-3)
    joint = jf.Joint(hub_inertia=1e-3, viscous_friction=1e-3, motor=motor)
    link = jf.Link(0.4, 0.15, 0.7, damping_ratio=0.01, modes=2)
    return jf.Arm((link,), (joint,), jf.Payload(0.02), drive="voltage")


def record(arm, seed=0):
    """What an arm shows under a wavy voltage, from the library's own adaptive integrator."""
    t = np.arange(SAMPLES) * DT
    voltage = 1.5 * np.sin(7 * t + seed) + 0.8 * np.sin(23 * t)
    run = jf.simulate(
        arm, OpenLoop(), Held(jnp.asarray(voltage)), jnp.asarray(t), method=jf.Adaptive(rtol=1e-9, atol=1e-11)
    )
    noise = np.random.default_rng(seed)
    channels = {"voltage_1": voltage}
    for name, std in (("angle_1", 1e-4), ("current_1", 5e-3), ("tip_deflection_1", 2e-5)):
        channels[name] = np.asarray(run[name]) + std * noise.standard_normal(SAMPLES)
    return jf.Recording(t, channels, ()), run


@pytest.fixture(scope="module")
def prepared():
    recording, run = record(nominal())
    return make_problem(ArmFile(nominal(), {"default": 0.03}, None), [recording]), run


def test_pieces_joined_are_the_simulation(prepared):
    """From the true start, pieces run end to end give what `simulate` gives."""
    problem, run = prepared[0].problem, prepared[1]
    whole, start = prepared[0].calibration[0], np.zeros(prepared[0].calibration[0].starts.shape[1])
    vector = problem.setting.parameters.start
    pieces, _ = problem.pieces(whole, vector)
    starts = np.zeros_like(whole.starts)
    model = problem.setting.parameters.build(jnp.asarray(vector)).assemble()
    starts[0] = start
    for j in range(whole.pieces - 1):
        found = respond(
            model, problem.instruments(vector), problem.setting.channels, jnp.asarray(starts), pieces
        )
        starts[j + 1] = found.end[j]
    found = respond(model, problem.instruments(vector), problem.setting.channels, jnp.asarray(starts), pieces)
    count = len(whole.times)
    for i, name in enumerate(problem.setting.channels):
        expected = np.asarray(run[name])[:count]
        ours = np.asarray(found.reading)[..., i].ravel()[:count]
        np.testing.assert_allclose(ours, expected, atol=3e-4 * np.abs(expected).max())


def slopes(problem, run, vector, column, h=1e-6):
    """Slopes of readings and ends by differences."""
    up, down = vector.copy(), vector.copy()
    up[column], down[column] = up[column] + h, down[column] - h
    a, b = problem.predict(run, up), problem.predict(run, down)
    return (a.reading - b.reading) / (2 * h) / problem.setting.noise, (a.end - b.end) / (2 * h)


def everywhere(vector, response):
    """Every interval made linear by itself."""
    return np.ones(response.states.shape[:2], bool)


def test_slopes_by_starts_lags_and_bristles_are_finite_differences(prepared, monkeypatch):
    problem, run = prepared[0].problem, prepared[0].calibration[0]
    monkeypatch.setattr(problem, "rough", everywhere)
    names = problem.setting.parameters.names
    vector = problem.setting.parameters.start.copy()
    vector[names.index("coulomb_friction at joint_1: torque")] = 2e-3
    vector[names.index("sensor_lag at tip_deflection_1: lag")] = 3e-3
    columns = [
        names.index("sensor_lag at tip_deflection_1: lag"),
        names.index("coulomb_friction at joint_1: presliding"),
    ]
    linear = problem.linearise(run, vector, columns)
    run.slopes = run.point = None
    for k, column in enumerate(columns):
        reading, end = slopes(problem, run, vector, column)
        np.testing.assert_allclose(linear.by_column[..., k], reading, atol=1e-4 * np.abs(reading).max())
        np.testing.assert_allclose(linear.end_by_column[..., k], end, atol=1e-4 * np.abs(end).max())
    starts, h = run.starts, 1e-6
    for state in range(starts.shape[1]):
        shifted = []
        for sign in (1, -1):
            moved = starts.copy()
            moved[:, state] += sign * h
            shifted.append(problem.predict(dataclasses.replace(run, starts=moved), vector))
        reading = (shifted[0].reading - shifted[1].reading) / (2 * h) / problem.setting.noise
        scale = np.abs(reading).max()
        np.testing.assert_allclose(linear.by_start[..., state], reading, atol=1e-4 * scale + 1e-9)


@pytest.mark.parametrize("torque", [0.0, 2e-3])
def test_intervals_left_out_are_between_those_made_linear(prepared, monkeypatch, torque):
    """Where nothing sticks or turns, slopes change slowly; where something does, every interval counts."""
    problem, run = prepared[0].problem, prepared[0].calibration[0]
    names = problem.setting.parameters.names
    vector = problem.setting.parameters.start.copy()
    friction = [names.index(f"coulomb_friction at joint_1: {field}") for field in ("torque", "presliding")]
    vector[friction[0]] = torque
    columns = [names.index(name) for name, _ in MOVED] + (friction if torque else [])
    some = problem.linearise(run, vector, columns)
    run.slopes = run.point = None
    monkeypatch.setattr(problem, "rough", everywhere)
    every = problem.linearise(run, vector, columns)
    run.slopes = run.point = None
    for a, b in ((some.by_start, every.by_start), (some.by_column, every.by_column)):
        scale = np.sqrt(np.mean(b**2, (0, 1, 2)))
        assert (np.sqrt(np.mean((a - b) ** 2, (0, 1, 2))) < 0.01 * scale + 1e-12).all()
    assert not np.array_equal(some.by_column, every.by_column)


MOVED = (  # parameters of the arm, with values at which they act both ways
    ("length", 0.0),
    ("torque_constant", 0.0),
    ("hub_inertia", 0.0),
    ("resistance", 0.0),
    ("inductance", 0.0),
    ("payload_mass at tip: mass", 0.0),
    ("gravity at base: along_y", 0.0),
    ("viscous_friction at joint_1: coefficient", 1e-3),
    ("root_compliance at link_1: compliance", 1e-2),
    ("winding_heating at joint_1: coefficient", 1e-2),
)


def slope_errors(step, cooling=0.5):
    """Error of the slopes by parameters of the arm, as a share of them, where samples are `step` apart."""
    t = np.arange(round(0.4 / step)) * step
    rng = np.random.default_rng(3)
    channels = {"voltage_1": 1.5 * np.sin(7 * t) + 0.8 * np.sin(23 * t)}
    for name, size in (("angle_1", 0.3), ("current_1", 0.5), ("tip_deflection_1", 2e-3)):
        channels[name] = size * np.sin(7 * t) + 1e-4 * size * rng.standard_normal(len(t))
    file = ArmFile(nominal(), {"default": 0.03}, None)
    problem = make_problem(file, [jf.Recording(t, channels, ())]).problem
    problem.setting.substeps = 6
    run = make_problem(file, [jf.Recording(t, channels, ())]).calibration[0]
    names = problem.setting.parameters.names
    vector = problem.setting.parameters.start.copy()
    vector[names.index("winding_heating at joint_1: cooling_time")] = cooling
    for name, value in MOVED:
        vector[names.index(name)] = value
    columns = [names.index(name) for name, _ in MOVED]
    linear = problem.linearise(run, vector, columns)
    errors = {}
    for k, (name, _) in enumerate(MOVED):
        reading, _ = slopes(problem, run, vector, columns[k])
        errors[name] = np.sqrt(np.mean((linear.by_column[..., k] - reading) ** 2) / np.mean(reading**2))
    return errors


def test_slopes_by_parameters_are_of_second_order_in_the_sample_time():
    coarse, fine = slope_errors(4e-3), slope_errors(1e-3)
    for name, error in coarse.items():
        assert error < 0.2, name
        assert fine[name] < max(error / 10, 2e-4), (name, error, fine[name])


def test_a_fit_over_any_horizon_finds_the_parameters(prepared):
    """Truth hidden from the fit: a torque constant 4 % off."""
    arm = nominal()
    motor = dataclasses.replace(arm.joints[0].motor, torque_constant=0.0624)
    true = dataclasses.replace(arm, joints=(dataclasses.replace(arm.joints[0], motor=motor),))
    found = make_problem(ArmFile(arm, {"default": 0.03}, None), [record(true, 3)[0]])
    names = found.problem.setting.parameters.names
    column = names.index("torque_constant")
    free = Freedom((column,), np.ones(1), np.zeros(1), np.full(1, -np.inf), np.full(1, np.inf))
    vector = found.problem.setting.parameters.start
    for horizon in (1, 5, 1000):
        result = fit(found.problem, found.calibration, vector, free, horizon, 4)
        assert result.level < 1.3
        value = 0.06 * np.exp(0.03 * result.vector[column])
        assert value == pytest.approx(0.0624, rel=3e-3)
        vector = result.vector


def test_the_latent_force_is_the_force(prepared):
    """A torque pulse that the model knows nothing of is found where, when and as large as it was."""

    class Pulse(jf.AbstractReference):
        def __call__(self, t):
            return (jnp.where((t > 0.4) & (t < 0.6), 0.01, 0.0),)

        def jumps(self):
            return jnp.array([0.4, 0.6])

        def end(self):
            return jnp.asarray(0.6)

    arm = nominal()
    t = np.arange(SAMPLES) * DT
    voltage = 1.5 * np.sin(7 * t)
    run = jf.simulate(arm, OpenLoop(), Held(jnp.asarray(voltage)), jnp.asarray(t), disturbance=Pulse())
    noise = np.random.default_rng(1)
    channels = {"voltage_1": voltage}
    for name, std in (("angle_1", 1e-5), ("current_1", 5e-4), ("tip_deflection_1", 2e-6)):
        channels[name] = np.asarray(run[name]) + std * noise.standard_normal(SAMPLES)
    found = make_problem(ArmFile(arm, {"default": 0.03}, None), [jf.Recording(t, channels, ())])
    search = Search(found.problem, found.calibration, print)
    vector = search.settle(found.problem.setting.parameters.start).vector
    first = search.latent(vector)[0]
    assert first.equation == "joint_1"
    inside = (first.times > 0.42) & (first.times < 0.58)
    outside = (first.times < 0.36) | (first.times > 0.64)
    assert np.mean(first.values[inside]) == pytest.approx(0.01, rel=0.05)
    assert np.sqrt(np.mean(first.values[outside] ** 2)) < 1.5e-3


def test_every_third_piece_shows_what_it_shows_among_all(prepared):
    problem, runs = prepared[0].problem, prepared[0].calibration
    start = problem.setting.parameters.start
    whole, some = problem.predict(runs[0], start), problem.predict(runs[0].thinned(3), start)
    assert np.array_equal(some.reading, whole.reading[::3])
    assert np.array_equal(some.end, whole.end[::3])


def test_a_delayed_command_keeps_its_impulse():
    times = np.arange(50) * 0.01
    command = np.sin(9 * times)
    same, _ = delayed(times, command, 0.0, 0.01)
    np.testing.assert_allclose(same, command, atol=1e-12)
    whole, _ = delayed(times, command, 0.03, 0.01)
    np.testing.assert_allclose(whole[3:], command[:-3], atol=1e-12)
    np.testing.assert_allclose(whole[:3], command[0], atol=1e-12)
    late, slope = delayed(times, command, 0.013, 0.01)
    later, _ = delayed(times, command, 0.013 + 1e-7, 0.01)
    np.testing.assert_allclose(slope, (later - late) / 1e-7, atol=1e-5)
