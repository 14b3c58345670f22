"""The plants of the blind data are right, and share nothing with the library that they test."""

import ast
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize

import experiments.blind
from experiments.blind import two_link
from experiments.blind.beam import clamped_beam
from experiments.blind.drive import plant_arrays, record
from experiments.blind.joint import MICRO_DAMPING
from experiments.blind.rigs import LINK, NOISE, true_rig
from experiments.blind.simulator import CHANNELS, SAMPLE, run
from experiments.blind.structure import COORDINATES, STATES, structure

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
    """Readings [samples, channels, joints] and states of a rig without its controller; its arrays."""
    rig = rig.copy()
    rig.set(slice(None), stiffness=0.0, damping=0.0)
    plant = plant_arrays([rig], substeps)
    nothing = np.zeros((samples, rig.nominal.joints, 1))
    _, read, states = run(
        rig.nominal.physics,
        plant,
        start[:, None],
        nothing,
        nothing + drive,
        nothing,
        substeps=substeps,
        keep=1,
    )
    return (
        np.asarray(read)[..., 0],
        np.asarray(states)[..., 0],
        {k: v[..., 0] for k, v in plant["arm"].items()},
    )


def lossless(plant):
    """A rig with an open winding and nothing that dissipates."""
    rig = true_rig(plant, "energy")
    for name, value in {"viscous_friction": 0.0, "damping_ratio": 0.0, "resistance": 1e9}.items():
        rig.body[name][:] = value
    return rig


def energy_of_one(substeps):
    """Total and kinetic energy [J] of a swinging, ringing arm: a cable, a link that stiffens and shortens, a stop."""
    rig = lossless("single_link")
    rig.body["foreshortening"][:] = 1.0
    rig.set(0, cable=0.3, hardening=1e5)
    rig.arm |= {"gravity_field": 3.0, "stop": 20.0, "stop_place": 0.1}
    start = np.zeros(STATES)
    start[V.start], start[X.start + 1] = 6.0, 2e-3
    _, states, _ = free_run(rig, start, 1000, substeps)
    s = structure(rig.body)
    mass = np.linalg.inv(s["mobility"][:5, :5])
    stiff = -mass @ s["system"][V, X][:5, :5]
    x, v = states[:, X][:, :5], states[:, V][:, :5]
    angle, rate = states[:, X] @ s["frame"], states[:, V] @ s["frame"]
    bent, tip = states[:, X] @ s["deflection"], states[:, X] @ s["tip"]
    outward = np.diag(s["mode"]) - rig.body["foreshortening"][0] * s["tension"]
    thrown = np.einsum("ni,ij,nj->n", states[:, X], outward, states[:, X])
    kinetic = 0.5 * np.einsum("ni,ij,nj->n", v, mass, v) + 0.5 * rate**2 * thrown
    stored = 0.5 * np.einsum("ni,ij,nj->n", x, stiff, x) + 0.15 * angle**2 + 1e5 / 4 * bent**4
    stored += 10.0 * np.maximum(tip - 0.1, 0.0) ** 2
    sideways = states[:, X] @ s["gravity"] - s["first_moment"] * angle
    height = s["first_moment"] * np.sin(angle) + np.cos(angle) * sideways
    return kinetic + stored + 3.0 * height, kinetic


def energy_of_two(substeps):
    """The same of two swinging, ringing links: every point moves with (u - w turn, v + x turn + w')."""
    rig = lossless("two_link")
    rig.body["foreshortening"][:] = 5.0
    rig.arm["gravity_field"] = 3.0
    n = two_link.COORDINATES
    start = np.zeros(two_link.STATES)
    start[2 + 4], start[2 + 4 + two_link.MODES] = 5e-3, 2e-3
    start[2 + n : 2 + n + 4] = [2.0, -3.0, 2.0, -3.0]
    _, states, a = free_run(rig, start, 1000, substeps)
    _, (_, turn, q), (_, rate, q_rate) = two_link.unpack(states.T)
    u = v = height = total = 0.0
    spin = heading = 0.0
    for j in range(2):
        spin, heading = spin + rate[j], heading + turn[j]
        m, s, c, b = (a[k][j] for k in ("mass", "first_moment", "coupling", "weight"))
        inertia = a["inertia"][j] + a["hub"][j] + np.einsum("kn,kl,ln->n", q[j], a["outward"][j], q[j])
        total += 0.5 * m * (u * u + v * v) + 0.5 * spin**2 * inertia + 0.5 * (q_rate[j] ** 2).sum(axis=0)
        total += spin * (c @ q_rate[j]) + v * (s * spin + b @ q_rate[j]) - u * spin * (b @ q[j])
        total += 0.5 * a["stiff"][j] @ q[j] ** 2
        total += 3.0 * (m * height + s * np.sin(heading) + np.cos(heading) * (b @ q[j]))
        w, w_rate, slope = a["tip"][j] @ q[j], a["tip"][j] @ q_rate[j], a["tip_slope"][j] @ q[j]
        height = height + a["length"][j] * np.sin(heading) + w * np.cos(heading)
        along, across = u - spin * w, v + spin * a["length"][j] + w_rate
        spin, heading = spin + a["tip_slope"][j] @ q_rate[j], heading + slope
        bend = turn[1] + slope
        u, v = np.cos(bend) * along + np.sin(bend) * across, np.cos(bend) * across - np.sin(bend) * along
    return total, 0.5 * rate[0] ** 2 * a["inertia"][0]


@pytest.mark.parametrize("energy, loss, order", [(energy_of_one, 5e-4, 1), (energy_of_two, 1e-5, 2)])
def test_energy_is_kept(energy, loss, order):
    """Over 2 s at 20 kHz, but for `loss` of what is exchanged, which shrinks with the step."""
    losses = {}
    for substeps in (10, 40):
        total, kinetic = energy(substeps)
        losses[substeps] = np.ptp(total) / np.ptp(kinetic)
    assert losses[40] < loss
    assert losses[40] < 1.3 * 0.25**order * losses[10]


@pytest.mark.parametrize("plant", ["single_link", "two_link"])
def test_a_joint_that_sticks_and_turns_has_converged(plant):
    """Under dry friction with a rise and an asymmetry, 2 s at 20 kHz: of second order, and far below the noise."""
    rig = true_rig(plant, "sticks")
    rig.set(0, dry=0.01, asymmetry=0.2, stribeck=0.005)
    drive = np.sin(2 * np.pi * 1.3 * np.arange(1000) * SAMPLE)[:, None, None]
    start = np.zeros(rig.nominal.physics.STATES)
    rough, fine, finest = (free_run(rig, start, 1000, n, drive)[0][:, :3] for n in (10, 40, 160))
    noise = np.array([NOISE[c] for c in CHANNELS[:3]])[:, None]
    close, closer = (np.sqrt(np.mean((a - finest) ** 2, axis=0)) / noise for a in (rough, fine))
    assert closer.max() < 0.02
    assert closer.max() < 1.3 / 16 * close.max()


def test_motor_reaches_its_speed():
    """Bare axis: w = K V / (R b + K K_b) and i = b w / K, the closed form."""
    rig = true_rig("axis", "speed")
    read, _, _ = free_run(rig, np.zeros(STATES), 6000, drive=2.0)
    b = {k: v[0] for k, v in rig.body.items()}
    speed = 2 * b["torque_constant"]
    speed /= b["resistance"] * b["viscous_friction"] + b["torque_constant"] * b["back_emf_constant"]
    assert read[-1, CHANNELS.index("rate"), 0] == pytest.approx(speed, rel=1e-6)
    current = b["viscous_friction"] * speed / b["torque_constant"]
    assert read[-1, CHANNELS.index("current"), 0] == pytest.approx(current, rel=1e-6)


def test_stiff_link_is_a_rigid_one():
    stiff = true_rig("single_link", "rigid")
    stiff.body["youngs_modulus"] *= 1e5
    b = {k: v[0] for k, v in stiff.body.items()}
    beam = clamped_beam(b["length"], b["density"] * b["width"] * b["thickness"], 1.0,
                        b["payload_mass"], b["payload_inertia"], 1)  # fmt: skip
    axis = stiff.copy()
    axis.body["length"][:] = 0.0
    axis.body["hub_inertia"] += beam.inertia
    bent, _, _ = free_run(stiff, np.zeros(STATES), 500, drive=1.0)
    rigid, _, _ = free_run(axis, np.zeros(STATES), 500, drive=1.0)
    np.testing.assert_allclose(bent[:, 0], rigid[:, 0], atol=1e-5 * rigid[-1, 0, 0])


def test_two_links_with_the_second_joint_held_swing_as_one():
    """A cable of great stiffness locks joint 2: the first frequency is that of the straight cantilever."""
    rig = lossless("two_link")
    rig.set(slice(None), cable=1e4)
    start = np.zeros(two_link.STATES)
    start[2 + 4] = 1e-3
    read, _, _ = free_run(rig, start, 4096)
    signal = read[:, CHANNELS.index("tip_deflection"), 0] * np.hanning(4096)
    spectrum = np.abs(np.fft.rfft(signal, 1 << 17))
    found = np.argmax(spectrum) / ((1 << 17) * SAMPLE)
    assert found == pytest.approx(stepped_cantilever(rig), rel=5e-3)


def stepped_cantilever(rig):
    """First frequency [Hz] of both links as one clamped beam with hub and payload, by Rayleigh's
    quotient over polynomials, with a jump of curvature at the joint."""
    b = rig.body
    joint = b["length"][0]
    mass, stiff = np.zeros((7, 7)), np.zeros((7, 7))
    nodes, weights = np.polynomial.legendre.leggauss(24)

    def shapes(x):
        beyond = np.maximum(x - joint, 0.0)
        value = np.stack([x**2, x**3, x**4, beyond**2, beyond**3, beyond**4, x**5])
        slope = np.stack([2 * x, 3 * x**2, 4 * x**3, 2 * beyond, 3 * beyond**2, 4 * beyond**3, 5 * x**4])
        step = (x > joint).astype(float)
        curve = np.stack([2 + 0 * x, 6 * x, 12 * x**2, 2 * step, 6 * beyond, 12 * beyond**2, 20 * x**3])
        return value, slope, curve

    begin = 0.0
    for j in range(2):
        x = begin + (nodes + 1) * b["length"][j] / 2
        w = weights * b["length"][j] / 2
        value, _, curve = shapes(x)
        area = b["width"][j] * b["thickness"][j]
        mass += (value * w * b["density"][j] * area) @ value.T
        stiff += (curve * w * b["youngs_modulus"][j] * area * b["thickness"][j] ** 2 / 12) @ curve.T
        begin += b["length"][j]
    for x, m, inertia in (
        (joint, b["hub_mass"][1], b["hub_inertia"][1]),
        (begin, b["payload_mass"][0], b["payload_inertia"][0]),
    ):
        value, slope, _ = shapes(np.array([x]))
        mass += m * value @ value.T + inertia * slope @ slope.T
    return np.sqrt(scipy.linalg.eigh(stiff, mass, eigvals_only=True)[0]) / (2 * np.pi)


@pytest.mark.slow
@pytest.mark.parametrize(
    "plant, modes, dry, error",
    [("single_link", 4, 0.0, 0.01), ("single_link", 4, 0.01, 0.02), ("two_link", 3, 0.0, 0.5)],
)
def test_two_independent_models_agree(plant, modes, dry, error):
    """The library, given the true parameters, follows the plant to `error` of the noise."""
    import jax.numpy as jnp

    import controllers as ctl
    import jaxflex as jf

    rig = true_rig(plant, "agreement")
    rig.set(0, dry=dry)
    b, joints = rig.body, range(rig.nominal.joints)
    voltage, read, _ = record([rig], 40)

    def values(names, j):
        return [b[name][j] for name in names]

    motors = [jf.DCMotor(*values(("resistance", "torque_constant", "back_emf_constant", "inductance"), j))
              for j in joints]  # fmt: skip
    friction = jf.EFFECTS["coulomb_friction"](dry, transition_rate=1e-4, presliding=rig.laws["presliding"][0],
                                              bristle_damping=MICRO_DAMPING)  # fmt: skip
    arm = jf.Arm(
        tuple(jf.Link.from_rectangle(*values(LINK[:5], j), damping_ratio=b["damping_ratio"][j], modes=modes)
              for j in joints),
        tuple(jf.Joint(hub_inertia=b["hub_inertia"][j], viscous_friction=b["viscous_friction"][j],
                       hub_mass=b["hub_mass"][j] if j else 0.0, motor=motors[j]) for j in joints),
        jf.Payload(b["payload_mass"][0], b["payload_inertia"][0]),
        effects=(friction,) if dry else (),
        drive="voltage",
    )  # fmt: skip
    times = jnp.arange(500) * SAMPLE
    reference = ctl.Sampled(times, jnp.asarray(voltage[:500, :, 0, 1]), kind="hold")
    method = jf.Adaptive(rtol=1e-8, atol=1e-10)
    names = [f"{c}_{j + 1}" for c in CHANNELS[:3] for j in joints]
    model = jf.simulate(arm, ctl.OpenLoop(), reference, times, method=method, channels=names)
    for c in range(3):
        for j in joints:
            difference = np.asarray(model[f"{CHANNELS[c]}_{j + 1}"]) - read[:500, c, j, 0, 1]
            assert np.sqrt(np.mean(difference**2)) < error * NOISE[CHANNELS[c]], (CHANNELS[c], j)
