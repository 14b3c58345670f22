"""What is searched, and what is held out."""

import pytest

from jaxflex.diagnosis.prepare import HeldOut, make_problem


@pytest.mark.parametrize(
    "held_out, searched, rest",
    [
        (HeldOut.RUNS, [1001], [120]),
        (HeldOut.ENDS, [600, 50], [401, 70]),
        (HeldOut.BEGINNINGS, [601, 70], [400, 50]),
    ],
)
def test_every_sample_is_searched_or_held_out(recorded, held_out, searched, rest):
    """Also of a recording hardly longer than a piece of 50 samples."""
    file, (recording,) = recorded()
    found = make_problem(file, [recording, recording.window(0, 120)], held_out)
    assert [len(run.times) for run in found.calibration] == searched
    assert [len(run.times) for run in found.held_out] == rest
    later = found.calibration[0] if held_out is HeldOut.BEGINNINGS else found.held_out[0]
    begins = {HeldOut.RUNS: 0.0, HeldOut.ENDS: 1.2, HeldOut.BEGINNINGS: 0.8}
    assert later.times[0] == pytest.approx(begins[held_out])


def test_of_one_recording_the_end_is_held_out(recorded):
    file, recordings = recorded()
    found = make_problem(file, recordings)
    assert [len(run.times) for run in (*found.calibration, *found.held_out)] == [600, 401]
