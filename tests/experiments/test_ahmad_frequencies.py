import numpy as np
import pytest

from experiments.ahmad_frequencies.finite_elements import arm_frequencies
from experiments.ahmad_frequencies.run import run


@pytest.fixture(scope="module")
def figures(tmp_path_factory):
    return run(tmp_path_factory.mktemp("ahmad_frequencies"), True)


def test_frequencies_are_exact_to_a_hundredth(figures):
    assert len(figures["worst_error_pct"]) == 4
    assert max(figures["worst_error_pct"].values()) < 1.0


def test_the_papers_shapes_serve_locked_joints_alone(figures):
    errors = figures["error_pct_by_shapes"]
    assert errors["joints locked"]["clamped_tip_mass"][0] < 1.0
    assert errors["joints free"]["clamped_tip_mass"][0] > 10.0
    assert max(errors[held]["distal_mass_and_moment"][0] for held in errors) < 1.0


def test_finite_elements_have_converged(figures):
    errors = figures["finite_element_error_pct_by_elements"]
    np.testing.assert_allclose(np.log2(errors["4"] / errors["8"]), 4.0, atol=0.3)
    assert errors["24"] < 1e-3


def test_finite_elements_know_a_clamped_beam():
    # a centre mass beyond measure holds link 2 at its root, the joints locked: clamped-free, closed form
    found = arm_frequencies(0.0, 0.0, 24, True, centre=1e7, hub_inertia=1e7)
    closed = np.array([1.875104069, 4.694091133]) ** 2 * np.sqrt(1.0 / (0.2 * 0.5**4)) / (2 * np.pi)
    for value in closed:
        assert np.min(np.abs(found / value - 1)) < 1e-5
