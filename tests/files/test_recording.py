"""Recordings in memory: sample time, gaps, resampling, and what a comparison needs."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import jaxflex as jf
from jaxflex.files.prepare import busiest


def swing(times, **channels):
    return jf.Recording(times, {"angle_1": np.sin(times), **channels})


EVEN = np.arange(0.0, 2.0, 0.01)


@pytest.mark.parametrize("digits", [3, 4, 9])
def test_times_rounded_in_the_file_are_uniform(digits):
    step = 1 / 60
    recording = swing(np.round(step * np.arange(600), digits))
    assert recording.uniform
    assert recording.sample_time == pytest.approx(step, rel=1e-4)
    even = recording.to_uniform()
    np.testing.assert_allclose(np.diff(even.times), recording.sample_time, rtol=1e-9)
    np.testing.assert_array_equal(even["angle_1"], recording["angle_1"])


def test_lost_rows_do_not_change_the_sample_time():
    keep = np.ones(len(EVEN), dtype=bool)
    keep[[20, 50, 51, 120]] = False
    recording = swing(EVEN[keep])
    assert not recording.uniform and len(recording.gaps()) == 0
    assert recording.sample_time == pytest.approx(0.01)
    filled = recording.to_uniform()
    assert len(filled) == len(EVEN) and "196 samples to 200" in filled.repairs[-1]
    np.testing.assert_allclose(filled["angle_1"], np.sin(EVEN), atol=2e-4)  # h^2/8 over three steps
    assert np.max(np.abs(filled["angle_1"] - np.sin(EVEN))) > 1e-6


def test_pieces_between_gaps_hold_every_sample():
    times = np.concatenate([EVEN, EVEN + 5, EVEN + 9])
    pieces = swing(times).split_at_gaps()
    assert [len(piece) for piece in pieces] == [200, 200, 200]
    np.testing.assert_array_equal(np.concatenate([piece.times for piece in pieces]), times)
    with pytest.raises(jf.RecordingError, match=r"jumps after 1.99 s; split_at_gaps"):
        swing(times).to_uniform()


@given(
    steps=st.lists(st.floats(0.5, 2.0), min_size=10, max_size=60),
    ratio=st.floats(0.3, 4.0),
    seed=st.integers(0, 1000),
)
def test_resampling_keeps_straight_lines_and_the_impulse_of_held_inputs(steps, ratio, seed):
    times = np.cumsum(steps)
    voltage = np.random.default_rng(seed).normal(size=len(times))
    recording = jf.Recording(times, {"voltage_1": voltage, "angle_1": 3 * times - 1})
    step = ratio * recording.sample_time
    even = recording.to_uniform(step)
    np.testing.assert_allclose(np.diff(even.times), step)
    np.testing.assert_allclose(even["angle_1"], 3 * even.times - 1, atol=1e-9)
    end = even.times[-1] + step
    widths = np.diff(np.minimum(np.append(times, max(end, times[-1])), end))
    assert even["voltage_1"].sum() * step == pytest.approx(voltage @ widths, abs=1e-9)


def test_held_inputs_stay_steps_and_outputs_are_read_off_between():
    recording = jf.Recording(
        np.array([0.0, 1.0, 2.0]),
        {"voltage_1": np.array([1.0, 5.0, 2.0]), "angle_1": np.array([0.0, 2.0, 4.0])},
    )
    finer = recording.to_uniform(0.5)
    np.testing.assert_allclose(finer["voltage_1"], [1, 1, 5, 5, 2])
    np.testing.assert_allclose(finer["angle_1"], [0, 1, 2, 3, 4])
    coarser = recording.to_uniform(2.0)
    np.testing.assert_allclose(coarser["voltage_1"], [3, 2])
    free = recording.to_uniform(0.5, held=())
    np.testing.assert_allclose(free["voltage_1"], [1, 3, 5, 3.5, 2])


def test_a_step_longer_than_the_data_is_refused():
    with pytest.raises(jf.RecordingError, match="leaves 1 sample"):
        swing(EVEN).to_uniform(5.0)


@pytest.mark.parametrize(
    "times, channel, message",
    [
        ([0.0, 1.0], [0.0], "found shape"),
        ([0.0], [0.0], "at least two"),
        ([0.0, 1.0, 1.0], [0.0, 1.0, 2.0], "time does not rise"),
    ],
)
def test_recordings_made_in_memory_are_checked(times, channel, message):
    with pytest.raises(jf.RecordingError, match=message):
        jf.Recording(np.array(times), {"angle_1": np.array(channel)})


def test_required_channels_are_named_when_missing():
    still = np.full_like(EVEN, 0.3)
    recording = swing(EVEN, voltage_1=np.cos(EVEN), strain_1=still)
    found = jf.require_channels(recording, ["voltage_1"], ["angle_1", "strain_1", "current_1"])
    assert found == ("angle_1",)
    with pytest.raises(jf.RecordingError, match="torque_1: missing, found angle_1, voltage_1, strain_1"):
        jf.require_channels(recording, ["torque_1"], ["angle_1"])
    with pytest.raises(jf.RecordingError, match="strain_1 is constant; at least one of strain_1, current_1"):
        jf.require_channels(recording, ["voltage_1"], ["strain_1", "current_1"])
    with pytest.raises(jf.RecordingError, match="found angle_1, voltage_1, strain_1; at least one of rate_1"):
        jf.require_channels(recording, ["voltage_1"], ["rate_1"])
    with pytest.raises(jf.RecordingError, match="found 10 samples; at least 100"):
        jf.require_channels(recording.window(0, 10), ["voltage_1"], ["angle_1"])


def test_prepared_pieces_are_even_and_say_what_was_left_out():
    times = np.concatenate([EVEN, EVEN + 5, EVEN[:30] + 9])
    constant = np.zeros_like(times)
    recording = swing(times, voltage_1=np.cos(times), strain_1=constant, rate_1=np.cos(times))
    pieces = jf.prepare(recording, ["voltage_1"], ["angle_1", "strain_1"])
    assert [len(piece) for piece in pieces] == [200, 200]
    assert list(pieces[0].channels) == ["voltage_1", "angle_1"]
    words = " ".join(pieces[0].repairs)
    assert "strain_1: constant" in words and "30 samples in pieces shorter" in words
    one = jf.prepare(recording, ["voltage_1"], ["angle_1"], samples=200)
    assert len(one) == 1 and "1 longest of 2 pieces" in one[0].repairs[-1]
    short = swing(np.concatenate([EVEN[:90] + 5 * i for i in range(3)]), voltage_1=np.zeros(270))
    with pytest.raises(jf.RecordingError, match=r"without a gap lasts 0.89 s; at least 100"):
        jf.prepare(short, ["voltage_1"], ["angle_1"])


def test_the_busiest_part_is_where_things_move():
    times = 1e-3 * np.arange(100_000)
    motion = np.exp(-(((times - 63) / 2) ** 2)) * np.sin(20 * times)
    part = busiest(swing(times, rate_1=motion).window(0, 100_000), 8000)
    assert len(part) == 8000 and part.times[0] < 63 < part.times[-1]
    assert "of 100000 samples the 8000 from" in part.repairs[-1]
