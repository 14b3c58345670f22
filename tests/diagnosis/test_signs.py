"""Channels logged with the other sign are found, and turned round."""

import dataclasses

import numpy as np
import pytest

import jaxflex as jf
from experiments.blind.make import make_cases, write_case
from jaxflex.diagnosis.signs import righted

pytestmark = pytest.mark.optimised


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """An arm and a recording of it, with dry friction and a cable hidden, which leave a gap of hundreds."""
    folder = tmp_path_factory.mktemp("case")
    (made,) = make_cases("single_link", [("coulomb_friction", "cable_stiffness")], [1.0], [0], typical=True)
    write_case(made, folder)
    return jf.read_arm_file(folder / "arm.toml"), jf.read_recording(folder / "run_1.csv")


@pytest.mark.parametrize("names", [(), ("angle_1",), ("voltage_1",), ("current_1",)], ids="+".join)
def test_wrong_signs_are_turned_round_and_said(case, names):
    file, recording = case
    flipped = {n: -v if n in names else v for n, v in recording.channels.items()}
    (found,) = righted(file, [dataclasses.replace(recording, channels=flipped)])
    for name, values in recording.channels.items():
        np.testing.assert_array_equal(found[name], values, err_msg=name)
    said = [note for note in found.repairs if "other sign" in note]
    assert [note.partition(":")[0] for note in said] == sorted(names)
