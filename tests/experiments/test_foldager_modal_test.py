import numpy as np
import pytest

from experiments.foldager import CLAMPED_MEASURED, CLAMPED_THEORY, DRIVEN_MEASURED, PINNED_THEORY
from experiments.foldager_modal_test.identify import fit_peak
from experiments.foldager_modal_test.run import run


@pytest.fixture(scope="module")
def figures(tmp_path_factory):
    folder = tmp_path_factory.mktemp("modal_test")
    found = run(folder, reduced=True)
    assert {p.name for p in folder.iterdir()} == {"blow.png", "responses.png"}
    return found


def test_noisy_blows_find_the_poles(figures):
    for test in figures["tests"]["coupled"].values():
        assert len(test["picked_hz"]) == len(test["poles_hz"]) == 3
        np.testing.assert_allclose(test["picked_hz"], test["poles_hz"], rtol=1e-3)
        np.testing.assert_allclose(test["picked_damping_ratio"], test["poles_damping_ratio"], rtol=0.05)


def test_rows_of_table_1(figures):
    tests = figures["tests"]["coupled"]
    np.testing.assert_allclose(tests["driven"]["picked_hz"][:2], DRIVEN_MEASURED, rtol=0.07)
    np.testing.assert_allclose(tests["clamped"]["picked_hz"], CLAMPED_MEASURED, rtol=0.05)
    # theory rows, printed to two or three figures
    np.testing.assert_allclose(figures["theory_hz"]["clamped"], CLAMPED_THEORY, rtol=0.025)
    np.testing.assert_allclose(figures["theory_hz"]["pinned"], PINNED_THEORY, rtol=0.01)


def test_fit_of_one_exact_mode():
    lines = np.arange(0.0, 60.0, 0.05)
    s, pole = 2j * np.pi * lines, 2 * np.pi * 31.7
    response = 4.0 / (s**2 + 2 * 0.03 * pole * s + pole**2) + 2e-6  # and what other modes add
    peak = fit_peak(lines, response, 31.4)
    np.testing.assert_allclose(peak, (31.7, 0.03), rtol=1e-6)
