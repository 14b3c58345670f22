"""Each fault of a recording is found where it is, and a sound recording has none."""

import re

import numpy as np
import pytest

import jaxflex as jf
from jaxflex.files.checks import findings, standstills

STEP = 2e-3
TIMES = STEP * np.arange(5000)
COUNT = 2 * np.pi / 4096
rng = np.random.default_rng(1)


def encoder(angle):
    return COUNT * np.round(angle / COUNT)


def move(times=TIMES):
    """An angle [rad] that goes there, rings and comes to rest, twice."""
    there = np.clip(times / 3, 0, 1) - np.clip((times - 5) / 3, 0, 1)
    s = there**3 * (10 - 15 * there + 6 * there**2)
    return s + 0.02 * np.exp(-times) * np.sin(20 * times)


def recording(**changed):
    angle = move()
    channels = {
        "voltage_1": np.where(TIMES < 1, 0.0, np.where(TIMES < 3, 2.0, -1.0)),
        "angle_1": encoder(angle),
        "rate_1": np.gradient(angle, STEP) + 0.02 * rng.normal(size=TIMES.size),
        "tip_deflection_1": 0.01 * np.sin(30 * TIMES) + 2e-5 * rng.normal(size=TIMES.size),
        "current_1": np.round(np.sin(TIMES) + 0.01 * rng.normal(size=TIMES.size), 4),
    }
    return jf.Recording(TIMES, channels | changed)


def test_a_sound_recording_has_no_findings():
    assert findings(recording()) == []


@pytest.mark.parametrize("resolution", [1e-4, 1e-2])
def test_an_encoder_that_stops_by_itself_is_not_stuck(resolution):
    slow = resolution * np.round(move() / resolution)
    assert standstills(slow) == ([], 1)


def stuck():
    values = move().copy()
    values[700:900] = values[700]
    return encoder(values)


def tip():
    return 0.01 * np.sin(30 * TIMES) + 2e-5 * np.random.default_rng(2).normal(size=TIMES.size)


@pytest.mark.parametrize(
    "changed, message",
    [
        ({"current_1": np.zeros(5000)}, r"current_1: 0 \[A\] throughout: a dead sensor"),
        (
            {"angle_1": stuck(), "rate_1": np.ones(5000)},
            r"angle_1: stuck at .* for 201 samples in 1 place\(s\), first at 1.398 s",
        ),
        ({"tip_deflection_1": np.clip(tip(), -1, 0.007)}, r"tip_deflection_1: saturated at 0.007 \[m\]"),
        ({"tip_deflection_1": np.clip(tip(), -0.008, 1)}, r"tip_deflection_1: saturated at -0.008 \[m\]"),
        ({"tip_deflection_1": np.repeat(tip()[::10], 10)}, r"updated only every 10 samples"),
        ({"tip_deflection_1": 1e3 * tip()}, r"tip_deflection_1: ranges over 20.* \[m\].*\[mm\]"),
        ({"angle_1": 180 / np.pi * encoder(move())}, r"angle_1: ranges over 58.*\[rad\].*\[deg\]"),
        (
            {"rate_1": 180 / np.pi * np.gradient(move(), STEP)},
            r"the slope of angle_1 .*rate looks like \[deg/s\]",
        ),
        ({"rate_1": 30 / np.pi * np.gradient(move(), STEP)}, r"rate looks like \[rpm\]"),
        ({"rate_1": -np.gradient(move(), STEP)}, r"opposite sign"),
    ],
)
def test_faults_are_found(changed, message):
    assert any(re.search(message, each) for each in findings(recording(**changed)))


def test_commands_may_stand_still():
    assert findings(recording(voltage_1=np.zeros(5000), reference_1=np.ones(5000))) == []


@pytest.mark.parametrize(
    "times, message",
    [
        (np.concatenate([TIMES[:2500], TIMES[2500:] + 3]), r"time jumps 1 time\(s\).*from 4.998 s to 8 s"),
        (np.delete(np.append(TIMES, 10.0), 300), "steps of time vary from 0.002 s to 0.004 s; kept"),
        (1000 * TIMES, r"sample time 2 s is slow.*\[ms\]"),
    ],
)
def test_faults_of_time_are_found(times, message):
    (found,) = findings(jf.Recording(times, {"angle_1": encoder(move())}))
    assert re.search(message, found)
