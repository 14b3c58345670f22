"""Chains of pieces against one dense least-squares problem with all starts in it."""

import dataclasses
import itertools

import numpy as np
import pytest
from scipy.linalg import lstsq
from scipy.signal import lfilter

from jaxflex.diagnosis.chains import Linearised, condense, join

PIECES, SAMPLES, CHANNELS, STATES, COLUMNS = 7, 6, 2, 3, 2
COLOUR = [np.array([1.0, -0.7]), np.array([1.0])]
SPREAD = np.full(STATES, 1e3)


def linear(seed=0):
    draw = np.random.default_rng(seed).standard_normal
    return Linearised(
        residual=draw((PIECES, SAMPLES, CHANNELS)),
        by_start=draw((PIECES, SAMPLES, CHANNELS, STATES)),
        by_column=draw((PIECES, SAMPLES, CHANNELS, COLUMNS)),
        end_by_start=0.5 * draw((PIECES, STATES, STATES)),
        end_by_column=draw((PIECES, STATES, COLUMNS)),
        gap=draw((PIECES, STATES)),
    )


def dense(given, cuts):
    """Steps of the columns and of every start, from the readings, the starts' prior, and continuity by substitution."""
    firsts = len(cuts) - 1
    unknowns = COLUMNS + STATES * firsts
    rows, right, maps = [], [], []
    for chain, (first, last) in enumerate(itertools.pairwise(cuts)):
        start, offset = np.zeros((STATES, unknowns)), np.zeros(STATES)
        place = slice(COLUMNS + STATES * chain, COLUMNS + STATES * (chain + 1))
        start[:, place] = np.eye(STATES)
        prior = np.zeros((STATES, unknowns))
        prior[:, place] = np.diag(1 / SPREAD)
        slopes, residuals = [], []
        for j in range(first, last):
            maps.append((start, offset))
            slope = given.by_start[j] @ start
            slope[..., :COLUMNS] += given.by_column[j]
            slopes.append(slope)
            residuals.append(given.residual[j] - given.by_start[j] @ offset)
            start, offset = given.end_by_start[j] @ start, given.end_by_start[j] @ offset + given.gap[j]
            start[:, :COLUMNS] += given.end_by_column[j]
        slope, residual = np.concatenate(slopes), np.concatenate(residuals)
        for c, colour in enumerate(COLOUR):
            slope[:, c] = lfilter(colour, [1.0], slope[:, c], axis=0)
            residual[:, c] = lfilter(colour, [1.0], residual[:, c])
        rows += [slope.reshape(-1, unknowns), prior]
        right += [residual.ravel(), np.zeros(STATES)]
    found = lstsq(np.concatenate(rows), np.concatenate(right))[0]
    starts = np.stack([a @ found + b for a, b in maps])
    return found[:COLUMNS], starts, sum(float(r @ r) for r in right)


@pytest.mark.parametrize(("horizon", "cuts"), [(1, range(8)), (3, (0, 4, 7)), (7, (0, 7))])
def test_the_step_is_that_of_the_whole_least_squares_problem(horizon, cuts):
    given = linear()
    normal = condense(given, np.ones((PIECES, SAMPLES), bool), horizon, COLOUR, SPREAD)
    step = np.linalg.solve(normal.matrix, normal.vector)
    starts = np.zeros((PIECES, STATES))
    for joined in normal.back:
        joined.move(starts, step)
    expected_step, expected_starts, cost = dense(given, list(cuts))
    assert np.allclose(step, expected_step, rtol=1e-9)
    assert np.allclose(starts, expected_starts, rtol=1e-8, atol=1e-9)
    assert np.isclose(normal.cost, cost)
    assert normal.count == PIECES * SAMPLES * CHANNELS


def test_slopes_are_joined_once_and_serve_other_residuals():
    given, other = linear(), linear(1)
    valid = np.ones((PIECES, SAMPLES), bool)
    condense(given, valid, 3, COLOUR, SPREAD)
    moved = dataclasses.replace(given, residual=other.residual, gap=other.gap)
    assert join(moved, 3, COLOUR) is join(given, 3, COLOUR)
    again = condense(moved, valid, 3, COLOUR, SPREAD)
    fresh = condense(dataclasses.replace(moved, joined={}), valid, 3, COLOUR, SPREAD)
    assert np.array_equal(again.vector, fresh.vector)
    assert again.cost == fresh.cost


def test_a_motion_that_left_all_bounds_costs_everything():
    given = linear()
    given.residual[2, 0, 0] = np.nan
    assert condense(given, np.ones((PIECES, SAMPLES), bool), 1, COLOUR, SPREAD).cost == np.inf


def test_a_start_that_nothing_shows_stays_where_it_is():
    given = linear()
    given.by_start[..., 0] = 0.0
    given.end_by_start[:, :, 0] = 0.0
    normal = condense(given, np.ones((PIECES, SAMPLES), bool), 1, COLOUR, SPREAD)
    starts = np.zeros((PIECES, STATES))
    for joined in normal.back:
        joined.move(starts, np.zeros(COLUMNS))
    assert np.array_equal(starts[:, 0], np.zeros(PIECES))
    assert np.isfinite(starts).all()
