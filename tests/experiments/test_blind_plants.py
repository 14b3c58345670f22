"""The plants of the blind data are right, and share nothing with the library that they test."""

import ast
import copy
import dataclasses
from pathlib import Path

import numpy as np
import pytest
import scipy.optimize

import experiments.blind
from experiments.blind.beam import clamped_beam
from experiments.blind.drive import plant_arrays, record
from experiments.blind.effects import EFFECTS, available
from experiments.blind.gaps import measure
from experiments.blind.make import make_cases, with_peaks, write_case
from experiments.blind.outside import CATALOGUE
from experiments.blind.rigs import NOISE, true_rig
from experiments.blind.simulator import CHANNELS, SAMPLE, run
from experiments.blind.sizes import COARSE, hide
from experiments.blind.structure import COORDINATES, STATES
from jaxflex.files import arm_file, recording

X, V = slice(1, 1 + COORDINATES), slice(1 + COORDINATES, STATES)


def test_nothing_is_shared_with_the_library():
    for path in Path(experiments.blind.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not any(n.split(".")[0] in ("jaxflex", "controllers") for n in names), path.name


def roots(ratio, count):
    """beta l of a cantilever with tip mass `ratio` times its own."""

    def frequency_equation(b):
        return 1 + np.cos(b) * np.cosh(b) + ratio * b * (np.cos(b) * np.sinh(b) - np.sin(b) * np.cosh(b))

    grid = np.linspace(0.1, 12, 2000)
    values = frequency_equation(grid)
    changes = np.flatnonzero(values[:-1] * values[1:] < 0)[:count]
    return np.array([scipy.optimize.brentq(frequency_equation, grid[k], grid[k + 1]) for k in changes])


@pytest.mark.parametrize("ratio", [0.0, 0.5, 3.0])
def test_clamped_frequencies(ratio):
    length, rho, rigidity = 0.4, 0.15, 0.7
    beam = clamped_beam(length, rho, rigidity, ratio * rho * length, 0.0, 3)
    exact = roots(ratio, 3) ** 2 * np.sqrt(rigidity / (rho * length**4))
    np.testing.assert_allclose(beam.frequency, exact, rtol=5e-4)
    assert beam.inertia == pytest.approx(rho * length**3 / 3 + ratio * rho * length**3)
    assert beam.first_moment == pytest.approx(rho * length**2 / 2 + ratio * rho * length**2)


def test_foreshortening_of_a_rotating_beam():
    """The first frequency of a turning cantilever rises by 1.1933 of the square of its rate (out of plane)."""
    beam = clamped_beam(0.4, 0.15, 0.7, 0.0, 0.0, 1)
    assert beam.foreshortening[0, 0] == pytest.approx(1.1933, rel=2e-3)


def free_run(rig, start, samples, substeps=40, drive=0.0):
    plant, structures = plant_arrays([rig], substeps)
    nothing = np.zeros((samples, 1))
    plant["stiffness"][:] = plant["damping"][:] = 0.0
    _, read, states = run(plant, start[:, None], nothing, nothing + drive, nothing, substeps=substeps, keep=1)
    return np.asarray(read)[..., 0], np.asarray(states)[..., 0], structures[0]


def lossless(plant):
    """A rig with an open winding and nothing that dissipates."""
    rig = true_rig(plant, "energy")
    rig.body |= {"viscous_friction": 0.0, "damping_ratio": 0.0, "resistance": 1e9}
    return rig


def energy(substeps):
    """Total and kinetic energy [J] of a swinging, ringing arm with a cable, a stiffening link, a stop."""
    rig = lossless("single_link")
    rig.forces |= {"cable": 0.3, "weight": 3.0, "hardening": 1e5, "stop": 20.0, "stop_place": 0.1}
    start = np.zeros(STATES)
    start[V.start], start[X.start + 1] = 6.0, 2e-3
    _, states, s = free_run(rig, start, 1000, substeps)
    mass = np.linalg.inv(s["mobility"][:5, :5])
    stiff = -mass @ s["system"][V, X][:5, :5]
    x, v = states[:, X][:, :5], states[:, V][:, :5]
    angle, rate = states[:, X] @ s["frame"], states[:, V] @ s["frame"]
    bent, tip = states[:, X] @ s["deflection"], states[:, X] @ s["tip"]
    modes = states[:, X] * s["mode"]
    kinetic = 0.5 * np.einsum("ni,ij,nj->n", v, mass, v) + 0.5 * rate**2 * (modes**2).sum(axis=1)
    stored = 0.5 * np.einsum("ni,ij,nj->n", x, stiff, x) + 0.15 * angle**2 + 1e5 / 4 * bent**4
    stored += 10.0 * np.maximum(tip - 0.1, 0.0) ** 2
    sideways = states[:, X] @ s["gravity"] - s["first_moment"] * angle
    height = s["first_moment"] * np.sin(angle) + np.cos(angle) * sideways
    return kinetic + stored + 3.0 * height, kinetic


def test_energy_is_kept():
    """Of the energy exchanged, 0.3 % is lost in 2 s at 20 kHz, and the loss shrinks with the step."""
    losses = {}
    for substeps in (40, 160):
        total, kinetic = energy(substeps)
        assert np.ptp(kinetic) > 0.3 * total[0]
        losses[substeps] = np.ptp(total) / np.ptp(kinetic)
    assert losses[40] < 3e-3
    assert losses[160] < 0.3 * losses[40]


def test_motor_reaches_its_speed():
    """Bare axis: w = K V / (R b + K K_b) and i = b w / K, the closed form."""
    rig = true_rig("axis", "speed")
    b = rig.body
    read, _, _ = free_run(rig, np.zeros(STATES), 6000, drive=2.0)
    speed = 2 * b["torque_constant"]
    speed /= b["resistance"] * b["viscous_friction"] + b["torque_constant"] * b["back_emf_constant"]
    assert read[-1, CHANNELS.index("rate")] == pytest.approx(speed, rel=1e-6)
    current = b["viscous_friction"] * speed / b["torque_constant"]
    assert read[-1, CHANNELS.index("current")] == pytest.approx(current, rel=1e-6)


def test_stiff_link_is_a_rigid_one():
    stiff = true_rig("single_link", "rigid")
    stiff.body["youngs_modulus"] *= 1e5
    b = stiff.body
    beam = clamped_beam(b["length"], b["density"] * b["width"] * b["thickness"], 1.0,
                        b["payload_mass"], b["payload_inertia"], 1)  # fmt: skip
    axis = copy.deepcopy(stiff)
    axis.body |= {"length": 0.0, "hub_inertia": b["hub_inertia"] + beam.inertia}
    bent, _, _ = free_run(stiff, np.zeros(STATES), 500, drive=1.0)
    rigid, _, _ = free_run(axis, np.zeros(STATES), 500, drive=1.0)
    np.testing.assert_allclose(bent[:, 0], rigid[:, 0], atol=1e-5 * rigid[-1, 0])


@pytest.fixture(scope="module", params=["single_link", "axis"])
def plain(request):
    return request.param, with_peaks([true_rig(request.param, "effects")])[0]


def test_every_effect_at_zero_changes_nothing(plain):
    plant, rig = plain
    rigs = [copy.deepcopy(rig) for _ in available(plant)]
    for name, changed in zip(available(plant), rigs, strict=True):
        hide(changed, "effects", name, 0.0)
    _, read, _ = record([rig, *rigs], COARSE)
    for n, name in enumerate(available(plant)):
        np.testing.assert_allclose(read[:, :, n + 1], read[:, :, 0], rtol=0, atol=1e-9, err_msg=name)


def test_every_effect_shows(plain):
    plant, rig = plain
    rigs = [copy.deepcopy(rig) for _ in available(plant)]
    for name, changed in zip(available(plant), rigs, strict=True):
        hide(changed, "effects", name, EFFECTS[name].guess)
    gaps, _, _ = measure([rig] * len(rigs), rigs, COARSE)
    for name, gap in zip(available(plant), gaps, strict=True):
        assert max(gap.raw.values()) > 0.3, name


def test_a_parameter_within_its_uncertainty_leaves_no_gap():
    rig = true_rig("single_link", "fit")
    moved = dataclasses.replace(rig, body=rig.body | {"payload_mass": 1.04 * rig.body["payload_mass"]})
    gap = measure([rig], [moved], COARSE)[0][0]
    assert max(gap.raw.values()) > 10.0
    assert gap.size < 0.1


def test_cases_are_as_asked(tmp_path):
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
    log = recording.read_recording(tmp_path / "run_2.csv")
    assert set(log.channels) == {"voltage_1", "angle_1", "current_1", "tip_deflection_1"}
    assert log.repairs == ()
    difference = np.diff(log["current_1"], 4)[100:]
    assert difference.std() / 70**0.5 == pytest.approx(NOISE["current"], rel=0.1)
    again = make_cases("single_link", [wanted[2]], [], [0])[0]
    np.testing.assert_array_equal(again.runs[0]["current_1 [A]"], cases[2].runs[0]["current_1 [A]"])


@pytest.mark.slow
def test_two_independent_models_agree():
    """The library, given the true parameters and as many modes, follows the plant within the noise."""
    import jax.numpy as jnp

    import controllers as ctl
    import jaxflex as jf

    rig = true_rig("single_link", "agreement")
    b = rig.body
    voltage, read, _ = record([rig], 40)
    link = jf.Link.from_rectangle(
        *(b[k] for k in ("length", "width", "thickness", "youngs_modulus", "density")),
        damping_ratio=b["damping_ratio"], modes=4,
    )  # fmt: skip
    motor = jf.DCMotor(*(b[k] for k in ("resistance", "torque_constant", "back_emf_constant", "inductance")))
    joint = jf.Joint(hub_inertia=b["hub_inertia"], viscous_friction=b["viscous_friction"], motor=motor)
    payload = jf.Payload(b["payload_mass"], b["payload_inertia"])
    arm = jf.Arm((link,), (joint,), payload, drive="voltage")
    times = jnp.arange(500) * SAMPLE
    names = [f"{c}_1" for c in CHANNELS[:3]]
    reference = ctl.Sampled(times, jnp.asarray(voltage[:500, 0, 1])[:, None], kind="hold")
    method = jf.Adaptive(rtol=1e-8, atol=1e-10)
    model = jf.simulate(arm, ctl.OpenLoop(), reference, times, method=method, channels=names)
    for c, name in zip(CHANNELS, names, strict=False):
        error = np.asarray(model[name]) - read[:500, CHANNELS.index(c), 0, 1]
        assert np.sqrt(np.mean(error**2)) < 0.01 * NOISE[c], name
