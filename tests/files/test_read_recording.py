"""Recordings from CSV: what is refused, what is mended and said."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import jaxflex as jf
from jaxflex.files import read_recording as reader
from jaxflex.files.tables import write_series

GOOD = "time [s],voltage_1 [mV],angle_1 [deg]\n0,1000,0\n0.01,2000,90\n0.02,3000,180\n"


def read(text, tmp_path):
    path = tmp_path / "run.csv"
    path.write_text(text)
    return jf.read_recording(path)


def test_units_are_converted(tmp_path):
    recording = read(GOOD, tmp_path)
    np.testing.assert_allclose(recording["voltage_1"], [1, 2, 3])
    np.testing.assert_allclose(recording["angle_1"], [0, np.pi / 2, np.pi])
    np.testing.assert_allclose(recording.times, [0, 0.01, 0.02])
    assert recording.repairs == () and recording.source.endswith("run.csv")


@pytest.mark.parametrize(
    "rows, count, said",
    [
        ("0.03,nan,0\n0.04,,0\n0.05,1,0\n", 4, "2 of 6 rows hold a gap or NaN.*voltage_1.*first is row 5"),
        ("0.03,inf,0\n", 3, "1 of 4 rows"),
        (",1,0\n0.03,1,0\n", 4, "1 of 5 rows.*time.*row 5"),
        ("\n\n0.03,1,nan\n", 3, "first is row 7"),
        ("0.02,3000,180\n0.02,3000,180\n0.03,1,0\n", 4, "2 rows repeat.*first is row 5"),
        ("0.03,,0\n0.04,,1\n0.05,,1\n0.06,,3\n", 7, "voltage_1: no number in 4 of 7 rows"),
    ],
)
def test_bad_rows_are_left_out_and_said(rows, count, said, tmp_path):
    recording = read(GOOD + rows, tmp_path)
    assert len(recording) == count
    assert np.isfinite(recording["angle_1"]).all()
    (repair,) = [each for each in recording.repairs if "steps of time" not in each]
    assert re.search(said, repair)


@pytest.mark.parametrize(
    "text, message",
    [
        ("", "empty"),
        (GOOD.replace("time [s]", "time"), "column 'time': a header such as"),
        (GOOD.replace(",", ";"), "separated by commas"),
        (GOOD.replace("[deg]", "[V]"), r"unit \[V\] is not one of \[rad\]"),
        (GOOD.replace("angle_1", "mood_1"), "unknown channel"),
        (GOOD.replace("angle_1", "angle_x"), "unknown channel"),
        (GOOD.replace("angle_1", "angle_0"), "unknown channel"),
        (GOOD.replace("angle_1", "angle"), "unknown channel"),
        (GOOD.replace("0.02,", "0.005,"), "not rise at row 4: found 0.005 s after 0.01 s.*in order of time"),
        (GOOD.replace("0.02,", "0.01,"), "not rise at row 4.*more digits"),
        (GOOD + "0.4,1\n", "row 5: found 2 cells, the header has 3"),
        (GOOD + "\n0.4,1,x\n", "row 6, angle_1: 'x' is no number"),
        (GOOD.replace("voltage_1 [mV]", "angle_1 [rad]"), "angle_1: a channel is given twice"),
        ("time [s],angle_1 [rad]\n0,0\n", "at least two"),
        ("time [s],angle_1 [rad]\n0,0\nnan,0\nnan,1\n", "1 complete row.*2 of 3 rows"),
        ("time [s],angle_1 [rad]\n", "0 complete row"),
        ("angle_1 [rad],time [s]\n0,0\n1,1\n", "first column"),
    ],
)
def test_bad_recordings_say_why(text, message, tmp_path):
    with pytest.raises(jf.RecordingError, match=message):
        read(text, tmp_path)


def test_a_file_that_is_no_text_or_not_there(tmp_path):
    (tmp_path / "bytes.csv").write_bytes(b"time [s],angle_1 [rad]\n0,\xff\n")
    for name in ("bytes.csv", "none.csv"):
        with pytest.raises(jf.RecordingError, match=f"{name}: cannot be read"):
            jf.read_recording(tmp_path / name)


@pytest.mark.parametrize("cell, message", [("", None), ("x", "row 9, angle_1: 'x'")])
def test_rows_keep_their_numbers_over_several_chunks(cell, message, tmp_path, monkeypatch):
    monkeypatch.setattr(reader, "_ROWS", 3)
    rows = [f"{0.01 * i:.2f},{i},{i}" for i in range(10)]
    rows[7] = f"0.07,7,{cell}"
    text = "time [s],voltage_1 [V],angle_1 [rad]\n" + "\n".join(rows)
    if message:
        with pytest.raises(jf.RecordingError, match=message):
            read(text, tmp_path)
    else:
        recording = read(text, tmp_path)
        np.testing.assert_array_equal(recording["voltage_1"], [0, 1, 2, 3, 4, 5, 6, 8, 9])
        assert "first is row 9" in recording.repairs[0]


@given(
    st.lists(
        st.tuples(st.floats(1e-4, 1e-2), st.floats(-1e6, 1e6), st.floats(-1e3, 1e3)), min_size=2, max_size=50
    )
)
def test_written_series_are_read_back(tmp_path_factory, rows):
    steps, angle, tip = np.array(rows).T
    times = np.cumsum(steps)
    path = tmp_path_factory.mktemp("written") / "a.csv"
    write_series(path, times, {"angle_1": angle, "tip_x": tip})
    recording = jf.read_recording(path)
    np.testing.assert_allclose(recording.times, times, rtol=1e-8)
    np.testing.assert_allclose(recording["angle_1"], angle, rtol=1e-8)
    np.testing.assert_allclose(recording["tip_x"], tip, rtol=1e-8)


def test_measured_recordings_load_with_nothing_to_mend(shared):
    for path in sorted(shared.glob("*/*/run_*.csv")):
        recording = jf.read_recording(path)
        assert len(recording) > 100 and recording.uniform and recording.repairs == (), path


@pytest.mark.slow
def test_ten_million_rows(tmp_path):
    """Within a minute; the peak of memory stays near the size of the numbers."""
    import resource
    import time

    count = 10_000_000
    path = tmp_path / "long.csv"
    with open(path, "w") as stream:
        stream.write("time [s],voltage_1 [V],current_1 [A],angle_1 [rad],tip_deflection_1 [m]\n")
        for start in range(0, count, 1000):
            stream.writelines(
                f"{i * 1e-3:.3f},{i % 7},{i % 11}.5,0.{i % 97:02d},1e-{i % 5 + 2}\n"
                for i in range(start, start + 1000)
            )
    before, begin = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.perf_counter()
    recording = jf.read_recording(path)
    assert time.perf_counter() - begin < 60
    assert (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024 < 3 * count * 5 * 8
    assert len(recording) == count
    (piece,) = jf.prepare(recording, ["voltage_1"], ["angle_1"])
    assert len(piece) == 20_000 and "of 10000000 samples the 20000" in piece.repairs[-1]
