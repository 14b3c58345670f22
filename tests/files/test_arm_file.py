import tomllib

import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from jaxflex.effects import CoulombFriction
from jaxflex.files.arm_file import parse_arm

GOOD = """
name = "an arm"
[[link]]
length = 0.4
width = 0.04
thickness = 0.0014
youngs_modulus = 70e9
density = 2700.0
[[joint]]
hub_inertia = 1e-4
[joint.motor]
resistance = 1.2
torque_constant = 0.06
back_emf_constant = 0.06
"""


def parse(text):
    return parse_arm(tomllib.loads(text), "arm.toml")


def test_reads_what_it_says():
    file = parse(GOOD + "\n[payload]\nmass = 0.02\n[uncertainty]\ndefault = 0.03\n")
    arm = file.arm
    assert arm.drive == "voltage" and arm.gravity is None and file.uncertainty == {"default": 0.03}
    np.testing.assert_allclose(arm.links[0].mass_per_length, 2700 * 0.04 * 0.0014)
    np.testing.assert_allclose(arm.links[0].flexural_rigidity, 70e9 * 0.04 * 0.0014**3 / 12)
    np.testing.assert_allclose(arm.payload.mass, 0.02)
    assert arm.joints[0].motor.inductance is None


@pytest.mark.parametrize(
    "old, new, message",
    [
        ("length = 0.4", "", "arm.toml: link 1: length: missing; a positive number is needed"),
        ("length = 0.4", "length = -1", "link 1: length: found -1; a positive number is allowed"),
        ("length = 0.4", 'length = "long"', "found 'long'"),
        ("length = 0.4", "length = inf", "found inf"),
        ("length = 0.4", "length = nan", "found nan"),
        ("length = 0.4", "length = true", "found True"),
        ("length = 0.4", "length = 0.4\ncolour = 3", "link 1: colour: unknown key; allowed are"),
        ("length = 0.4", "length = 0.4\nmodes = 1.5", "modes: found 1.5; a whole number of at least 0"),
        ("length = 0.4", 'length = 0.4\nmode_shapes = "round"', "mode_shapes: found 'round'; allowed are"),
        ("length = 0.4", "length = 0.4\nmass_per_length = 1", "found together with a section"),
        ("length = 0.4", "length = 0.4\ndamping_ratio = 1.5", "damping_ratio: found 1.5"),
        ("length = 0.4", "length = 0.4\ndamping_ratio = [0.1]", "found 1 values for modes = 2"),
        ("length = 0.4", 'length = 0.4\ndamping = "none"', "damping: found 'none'; allowed is 'ahmad'"),
        ("length = 0.4", 'length = 0.4\nmodel = "lumped"\nsegments = 1', "at most segments = 1"),
        ("length = 0.4", "length = 0.4\ngauge_position = 0.5", "a number from 0 to the length"),
        ("length = 0.4", 'length = 0.4\ndeflection_from = "camera"', "tip, gauge"),
        ("density = 2700.0", "", "link 1: density: missing"),
        (
            "hub_inertia = 1e-4",
            "hub_inertia = -1e-4",
            "joint 1: hub_inertia: found -0.0001; a number of at least 0",
        ),
        ("resistance = 1.2", "", "joint 1: motor: resistance: missing"),
        ("resistance = 1.2", "resistance = 1.2\nefficiency = 1.2", "a number above 0, at most 1"),
        ("[[joint]]", "[joint]", "found one \\[joint\\] table; write \\[\\[joint\\]\\]"),
        ('name = "an arm"', "name = 3", "name: found 3; text in quotes"),
        ('name = "an arm"', "speed = 3", "arm.toml: speed: unknown key"),
        ('name = "an arm"', 'drive = {input = "steam"}', "drive: input: found 'steam'; allowed are"),
        ('name = "an arm"', "payload = 3", "payload: : found 3|payload"),
        (
            'name = "an arm"',
            'effect = [{name = "magic", location = "joint_1"}]',
            "effect 1: name: found 'magic'",
        ),
        (
            'name = "an arm"',
            'effect = [{name = "coulomb_friction", location = "joint_2", torque = 1}]',
            "joint_2",
        ),
        (
            'name = "an arm"',
            'effect = [{name = "coulomb_friction", location = "joint_1"}]',
            "torque: missing",
        ),
        ('name = "an arm"', "uncertainty = {warmth = 0.1}", "uncertainty: warmth: unknown key"),
    ],
)
def test_bad_files_say_what_and_where(old, new, message):
    with pytest.raises(jf.ArmFileError, match=message):
        parse(GOOD.replace(old, new, 1))


def test_no_joint_and_too_few_joints():
    with pytest.raises(jf.ArmFileError, match="at least one \\[\\[joint\\]\\]"):
        parse("name = 'x'")
    with pytest.raises(jf.ArmFileError, match="joint without a link needs a positive"):
        parse("[[joint]]\nviscous_friction = 1.0")
    with pytest.raises(jf.ArmFileError, match="found 'voltage', but joint 1 has no"):
        parse("drive = {input = 'voltage'}\n[[joint]]\nhub_inertia = 1.0")


def test_unreadable_files(tmp_path):
    with pytest.raises(jf.ArmFileError, match="cannot be read"):
        jf.load_arm(tmp_path / "nothing.toml")
    bad = tmp_path / "bad.toml"
    bad.write_text("length = = 3")
    with pytest.raises(jf.ArmFileError, match="not valid TOML"):
        jf.load_arm(bad)


@pytest.mark.parametrize(
    "arm",
    [
        jf.ahmad_arm(0.03),
        jf.ahmad_arm(damping="ahmad", drive="torque"),
        jf.foldager_link(model="lumped", segments=7),
        jf.Arm((), (jf.Joint(hub_inertia=2.0),), gravity=9.81, effects=(CoulombFriction(0.2),)),
    ],
    ids=["two links", "ahmad damping", "lumped", "axis"],
)
def test_what_is_written_is_read_back(arm, tmp_path):
    jf.save_arm(arm, tmp_path / "arm.toml", {"default": 0.1})
    file = jf.read_arm_file(tmp_path / "arm.toml")
    assert file.uncertainty == {"default": 0.1}
    import equinox as eqx

    assert eqx.tree_equal(arm, file.arm, rtol=1e-12, atol=0.0)


def test_files_of_the_measured_data_load(shared):
    paths = sorted(shared.glob("*/*/arm.toml"))
    assert paths
    for path in paths:
        arm = jf.load_arm(path)
        frequencies = jf.driven_frequencies(arm)
        assert np.all(np.isfinite(frequencies)) and jnp.asarray(frequencies).shape == (arm.assemble().size,)
