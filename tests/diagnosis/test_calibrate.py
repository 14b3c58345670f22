import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from jaxflex.diagnosis.adopt import adopt
from jaxflex.diagnosis.calibrate import begun_anew, bounded
from jaxflex.diagnosis.catalogue import Candidate
from jaxflex.diagnosis.plant import bristles
from jaxflex.effects import EFFECTS

FRICTION = Candidate("coulomb_friction", "joint_1", ("torque",), (("presliding", 2e-3),), ("presliding",))


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 10**6), count=st.integers(1, 6))
def test_a_bounded_step_goes_as_far_down_as_bounds_let_it(seed, count):
    """No entry below its bound, no pull left on what is free; what is held would go lower alone."""
    draw = np.random.default_rng(seed)
    root = draw.normal(size=(count, count)) + 2 * np.eye(count)
    matrix = root @ root.T + 0.1 * np.eye(count)  # far enough from singular for rounding not to show
    pull = draw.normal(size=count)
    least = np.where(draw.uniform(size=count) < 0.5, -np.inf, -draw.uniform(0, 0.5, count))
    step = bounded(matrix, pull, least)
    assert (step >= least).all()
    free = step > least
    np.testing.assert_allclose((pull - matrix @ step)[free], 0.0, atol=1e-9)
    naive = np.maximum(np.linalg.solve(matrix, pull), least)

    def cost(x):
        return x @ matrix @ x - 2 * pull @ x

    assert cost(step) <= cost(naive) + 1e-9
    if np.isinf(least).all():
        np.testing.assert_allclose(step, np.linalg.solve(matrix, pull))


def test_bristles_begin_as_the_piece_before_leaves_them(search):
    (run,), problem, parameters = search.runs, search.problem, search.parameters
    bent = bristles(parameters.arm.assemble())
    begun = run.starts.copy()
    run.starts[:, bent] = 0.3
    problem.bend(run, parameters.start)
    assert (run.starts[:, bent] == 0.3).all()  # without friction nothing tells of them
    vector = adopt(parameters, parameters.start, FRICTION, (0.01,))
    for _ in range(3):
        problem.bend(run, vector)
    ends = problem.predict(run, vector).end
    np.testing.assert_allclose(run.starts[1:, bent], ends[:-1, bent], atol=1e-6)
    assert (run.starts[0, bent] == 0.3).all()
    assert np.abs(run.starts[1:, bent]).max() > 0.9
    run.starts = begun


def test_pieces_astray_under_dry_friction_begin_anew(swung):
    """One that its start leads far off is put back; the others keep theirs; without friction none is touched."""
    search = swung(EFFECTS["coulomb_friction"](0.01, 1e-3, 2e-3))
    (run,), problem, parameters = search.runs, search.problem, search.parameters
    vector = adopt(parameters, parameters.start, FRICTION, (0.01,))
    search.settle(vector)
    settled, left = run.starts.copy(), problem.misfit(run, problem.predict(run, vector))
    assert not begun_anew(problem, run, vector)
    run.starts[3, 0] += 0.2  # rad
    astray = run.starts.copy()
    assert not begun_anew(problem, run, parameters.start)
    np.testing.assert_array_equal(run.starts, astray)
    assert begun_anew(problem, run, vector)
    here = problem.misfit(run, problem.predict(run, vector))
    assert here[3] < 2 * left[3] + 0.1
    np.testing.assert_array_equal(np.delete(run.starts, 3, 0), np.delete(settled, 3, 0))
