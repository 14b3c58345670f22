"""What is searched, and what is held out."""

import numpy as np
import pytest

from jaxflex.diagnosis.plant import heats
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


def test_the_heat_of_a_winding_is_guessed_from_its_current(recorded):
    """The work done in its resistance since the run began; a start may be off by all of it."""
    file, recordings = recorded()
    prepared = make_problem(file, recordings)
    setting, (run,) = prepared.problem.setting, prepared.calibration
    place = heats(setting.parameters.arm.assemble())
    guessed = run.starts[:, place][:, 0]
    motor, recording = file.arm.joints[0].motor, recordings[0]
    rate = np.gradient(recording["angle_1"], setting.sample_time)
    current = (recording["voltage_1"] - motor.back_emf_constant * rate) / motor.resistance
    power = np.asarray(motor.resistance * current**2)
    true = np.cumsum(power)[setting.length - 1 :: setting.length] * setting.sample_time
    assert guessed[0] == 0
    np.testing.assert_allclose(guessed[1:], true[: len(guessed) - 1], atol=0.1 * true[-1])
    last = max(r.starts[-1, place][0] for r in (run, *prepared.held_out))
    np.testing.assert_allclose(setting.start_spread[place], last)
