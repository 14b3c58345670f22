"""Designs are compared in two halves, of which one need not wait for the tuning."""

import jax.numpy as jnp
import numpy as np

import jaxflex as jf
from controllers import default_move, standard_start
from jaxflex.cli.comparison import HALF, STRETCHED, TUNED, UNTUNED, Contest, together
from jaxflex.cli.tune import make_problem


def test_halves_of_a_comparison_are_the_whole():
    masses = [0.0, 0.04]
    arm = jf.foldager_link(0.02, modes=1)
    path = default_move(arm)
    problem = make_problem(arm, masses, path)
    contest = Contest(arm, masses, masses, path, float(problem.total_time()), problem.impulses)
    untuned = contest.untuned()
    tuned = contest.tuned(problem.design(standard_start(problem)))
    assert list(untuned)[:2] == [UNTUNED, STRETCHED] and list(tuned)[-1] == TUNED
    assert len(untuned) == HALF and len(tuned) == HALF - 1  # one shaper takes too long
    whole = contest.held(untuned | tuned)
    halves = together(contest.held(untuned), contest.held(tuned))
    assert list(halves.designs) == list(whole.designs)
    assert halves.held_out.tolist() == [False, True, False]
    for one, other in zip(halves.assessment, whole.assessment, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(halves.trajectory["tip_x"], whole.trajectory["tip_x"], atol=1e-9)
    assert all(jnp.isclose(d.move_time(), contest.total) for n, d in halves.designs.items() if n != UNTUNED)
