"""Channels that were logged with the other sign than the arm's."""

# arrays of numpy go to JAX and come back, which its annotations do not foresee
# pyright: reportArgumentType=false

import dataclasses
from collections.abc import Sequence

import numpy as np

from ..files.arm_file import ArmFile
from ..files.recording import Recording
from .calibrate import settle
from .hypothesis import SOME
from .prepare import first_starts, make_problem, wanted_channels
from .runs import Run
from .shooting import Problem

ASTRAY = 50.0  # misfit a reading over the shortest horizon, in units of the noise: signs are tried beyond it
BETTER = 0.9  # of the misfit: what is left at most where a sign was wrong; where all are right, more than all of it


def righted(file: ArmFile, recordings: Sequence[Recording]) -> list[Recording]:
    """The recordings with every channel turned round whose sign was wrong, which their repairs say.

    Over a tenth of a second, with the arm as stated, a motion fits its mirror image worse than any
    missing effect makes it. One channel at a time is turned, the one that helps most. Without gravity
    an arm is its own mirror image, so that of two halves of the channels either may be the wrong one.
    """
    prepared = make_problem(file, recordings)
    problem, runs = prepared.problem, prepared.calibration
    start = problem.setting.parameters.start

    def misfit(signs: np.ndarray) -> float:
        return settle(problem, [_mirrored(problem, run, signs).thinned(SOME) for run in runs], start).level

    inputs, _ = wanted_channels(file.arm)
    names = (*inputs, *problem.setting.channels)
    wrong: frozenset[str] = frozenset()
    level = misfit(np.ones(len(names)))
    while ASTRAY < level < np.inf:
        tried = [wrong ^ {name} for name in names]
        levels = {turn: misfit(np.array([-1.0 if n in turn else 1.0 for n in names])) for turn in tried}
        best = min(levels, key=lambda turn: levels[turn])
        if not levels[best] < BETTER * level:
            break
        wrong, level = best, levels[best]
    notes = [f"{name}: logged with the other sign than the arm's; turned round" for name in sorted(wrong)]
    return [_turned(recording, wrong).noting(*notes) for recording in recordings]


def _mirrored(problem: Problem, run: Run, signs: np.ndarray) -> Run:
    """The run with its commands and readings times `signs`, its starts guessed anew."""
    of_commands, of_readings = np.split(signs, [run.command.shape[1]])
    command, reading = of_commands * run.command, of_readings * run.reading
    rows = reading.reshape(-1, reading.shape[-1])[: len(run.times)]
    starts = first_starts(problem.setting, run.times, rows, command)
    return Run(run.times, command, reading, run.valid, starts, starts.copy(), run.places)


def _turned(recording: Recording, names: frozenset[str]) -> Recording:
    channels = {name: -values if name in names else values for name, values in recording.channels.items()}
    return dataclasses.replace(recording, channels=channels)
