import numpy as np
import pytest

import jaxflex as jf
from jaxflex.files.tables import write_series

GOOD = "time [s],voltage_1 [mV],angle_1 [deg]\n0,1000,0\n0.1,2000,90\n0.3,3000,180\n"


def read(text, tmp_path):
    path = tmp_path / "run.csv"
    path.write_text(text)
    return jf.read_recording(path)


def test_units_are_converted(tmp_path):
    recording = read(GOOD, tmp_path)
    np.testing.assert_allclose(recording["voltage_1"], [1, 2, 3])
    np.testing.assert_allclose(recording["angle_1"], [0, np.pi / 2, np.pi])
    np.testing.assert_allclose(recording.times, [0, 0.1, 0.3])
    assert recording.repairs == ()


def test_gaps_are_left_out_and_said(tmp_path):
    recording = read(GOOD + "0.4,nan,0\n0.5,,0\n0.6,1,0\n", tmp_path)
    assert len(recording.times) == 4 and "2 of 6 rows" in recording.repairs[0]


@pytest.mark.parametrize(
    "text, message",
    [
        ("", "empty"),
        ("time [s]\n0\n1\n".replace("time [s]", "time"), "a header such as"),
        (GOOD.replace("[deg]", "[V]"), r"unit \[V\] is not one of \[rad\]"),
        (GOOD.replace("angle_1", "mood_1"), "unknown channel"),
        (GOOD.replace("0.3,", "0.05,"), "time does not rise at row 4"),
        (GOOD + "0.4,1\n", "row 5: found 2 cells, the header has 3"),
        (GOOD + "0.4,1,x\n", "row 5, angle_1: 'x' is no number"),
        (GOOD.replace("voltage_1 [mV]", "angle_1 [rad]"), "given twice"),
        ("time [s],angle_1 [rad]\n0,0\n", "at least two"),
        ("angle_1 [rad],time [s]\n0,0\n1,1\n", "first column"),
    ],
)
def test_bad_recordings_say_why(text, message, tmp_path):
    with pytest.raises(jf.RecordingError, match=message):
        read(text, tmp_path)


def test_written_series_are_read_back(tmp_path):
    times = np.linspace(0, 1, 5)
    write_series(tmp_path / "a.csv", times, {"angle_1": np.sin(times), "tip_x": times**2})
    recording = jf.read_recording(tmp_path / "a.csv")
    np.testing.assert_allclose(recording["angle_1"], np.sin(times), rtol=1e-8)


def test_measured_recordings_load(shared):
    for path in sorted(shared.glob("*/*/run_*.csv")):
        assert len(jf.read_recording(path).times) > 100
