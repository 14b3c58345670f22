import numpy as np
import pytest

from experiments.robust_tuning.run import run


@pytest.fixture(scope="module")
def figures(tmp_path_factory):
    return run(tmp_path_factory.mktemp("robust_tuning"), True)


@pytest.mark.slow
def test_the_front_lies_below_the_unshaped_moves(figures):
    front, unshaped = np.array(figures["front_mm"]), np.array(figures["others_mm"]["unshaped, textbook PD"])
    assert np.all(front < unshaped / 2)
    assert np.all(np.array(figures["front_held_out_payloads_mm"]) < unshaped)


@pytest.mark.slow
def test_tuned_designs_hold_on_arms_they_were_not_tuned_on(figures):
    for sweep in figures["sweeps"].values():
        textbook = np.max(sweep["textbook PD with feedforward"])
        for name, residual in sweep.items():
            if name.startswith("tuned"):
                assert np.max(residual) < textbook
