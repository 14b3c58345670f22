"""Recordings from MATLAB, LabVIEW and Parquet: the same run from every file."""

import sys

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from nptdms import ChannelObject, RootObject, TdmsWriter
from scipy.io import savemat

import jaxflex as jf

TIMES = np.linspace(0.0, 1.99, 200)
VOLTS = np.sin(5 * TIMES)
DEGREES = 20 * np.sin(3 * TIMES) + TIMES


def check(path, notes=()):
    recording = jf.read_recording(path)
    np.testing.assert_allclose(recording.times, TIMES, atol=1e-12)
    np.testing.assert_allclose(recording["voltage_1"], VOLTS)
    np.testing.assert_allclose(recording["angle_1"], np.deg2rad(DEGREES))
    assert set(recording.channels) == {"voltage_1", "angle_1"}
    said = "; ".join(recording.repairs)
    for note in notes:
        assert note in said, said
    return recording


def test_matlab(tmp_path):
    run = {"time": TIMES[:, None], "voltage_1": VOLTS, "angle_1": DEGREES, "comment": "first run"}
    savemat(tmp_path / "flat.mat", run | {"units": {"angle_1": "deg"}})
    check(tmp_path / "flat.mat", ["voltage_1: no unit given; taken as [V]", "left out: comment"])
    savemat(tmp_path / "struct.mat", {"log": run | {"units": {"angle_1": "deg", "time": "s"}}})
    check(tmp_path / "struct.mat")


def test_matlab_7_3(tmp_path):
    path = tmp_path / "new.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in {"time": TIMES, "voltage_1": VOLTS, "angle_1": DEGREES}.items():
            file[name] = values[None, :]
        file["units/angle_1"] = np.array([[ord(c)] for c in "deg"], dtype=np.uint16)
        file["units/angle_1"].attrs["MATLAB_class"] = b"char"
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(128))
    check(path)


def test_labview(tmp_path):
    def channel(name, values, **properties):
        return ChannelObject("rig", name, values, properties)

    step = {"wf_increment": 0.01, "wf_start_offset": 0.0, "wf_samples": 200}
    with TdmsWriter(tmp_path / "waveform.tdms") as writer:
        writer.write_segment(
            [RootObject(), channel("voltage_1", VOLTS, unit_string="V", **step),
             channel("angle_1", DEGREES, unit_string="deg", **step), channel("Untitled 3", VOLTS, **step)]
        )  # fmt: skip
    check(tmp_path / "waveform.tdms", ["left out: Untitled 3"])
    with TdmsWriter(tmp_path / "named.tdms") as writer:
        writer.write_segment(
            [channel("time [ms]", 1e3 * TIMES), channel("voltage_1 [mV]", 1e3 * VOLTS),
             channel("angle_1 [deg]", DEGREES)]
        )  # fmt: skip
    check(tmp_path / "named.tdms")


def test_parquet(tmp_path):
    fields = [
        pa.field("angle_1", pa.float64(), metadata={"unit": "deg"}),
        pa.field("time", pa.float64()),
        pa.field("voltage_1 [V]", pa.float64()),
    ]
    table = pa.table([DEGREES, TIMES, VOLTS], schema=pa.schema(fields))
    pyarrow.parquet.write_table(table, tmp_path / "run.parquet")
    recording = check(tmp_path / "run.parquet", ["time: no unit given; taken as [s]"])
    # what pandas writes of a recording is read back
    recording.to_pandas().to_parquet(tmp_path / "again.parquet")
    check(tmp_path / "again.parquet")


@pytest.mark.parametrize(
    "content, message",
    [
        ({"voltage_1": VOLTS}, "found voltage_1; 'time' and any of"),
        ({"time": TIMES, "angle_1": DEGREES[:-1]}, r"angle_1: found shape \(199,\), time has \(200,\)"),
        ({"time": TIMES, "angle_1": "high"}, "angle_1: found shape"),
        (
            {"time": TIMES, "angle_1": DEGREES, "units": {"angle_1": "volt"}},
            r"unit \[volt\] is not one of \[rad\]",
        ),
        ({"time": TIMES[::-1], "angle_1": DEGREES}, "time does not rise"),
    ],
)
def test_what_is_refused(content, message, tmp_path):
    savemat(tmp_path / "bad.mat", content)
    with pytest.raises(jf.RecordingError, match=message):
        jf.read_recording(tmp_path / "bad.mat")


@pytest.mark.parametrize("name", ["run.mat", "run.tdms", "run.parquet"])
def test_files_that_are_something_else(name, tmp_path):
    for path in (tmp_path / name, tmp_path / "absent" / name):
        if path.parent == tmp_path:
            path.write_text("time [s],angle_1 [rad]\n0,0\n")
        with pytest.raises(jf.RecordingError, match=rf"{name}: cannot be read"):
            jf.read_recording(path)


@pytest.mark.parametrize("module, name", [("nptdms", "run.tdms"), ("pyarrow.parquet", "run.parquet")])
def test_a_missing_reader_names_the_extra(module, name, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(jf.RecordingError, match=rf"{name}: .*pip install 'jaxflex\[recordings\]'"):
        jf.read_recording(tmp_path / name)
