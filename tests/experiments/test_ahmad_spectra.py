import numpy as np
import pytest

from experiments.ahmad_spectra.run import resonances, run


@pytest.fixture(scope="module")
def figures(tmp_path_factory):
    return run(tmp_path_factory.mktemp("ahmad_spectra"), True)


@pytest.mark.parametrize("load", ["0 g", "100 g"])
def test_peaks_of_the_second_tip_lie_on_the_exact_frequencies(figures, load):
    row, width = figures["payloads"][load], figures["resolution_of_the_peaks_hz"]
    peaks = np.array(row["peaks_hz, damping ratio 0.01"][1])
    for frequency in row["exact_hz"][1:3]:
        assert np.min(np.abs(peaks - frequency)) < 1.5 * width


def test_the_papers_second_link_is_the_exact_one_without_payload(figures):
    np.testing.assert_allclose(figures["payloads"]["0 g"]["paper_over_nearest_exact"][1], 1.0, atol=0.03)


def test_resonances_are_told_from_ripple():
    f = np.linspace(0.0, 40.0, 401)
    density = 1 / ((f - 12) ** 2 + 0.1) + 2 / ((f - 30) ** 2 + 0.1) + 0.02 * (3 + np.cos(40 * f))
    assert resonances(f, density) == [12.0, 30.0]


def test_the_papers_second_link_implies_an_extended_payload(figures):
    assert 40 < figures["radius_of_gyration_mm"] < 70
    for row in figures["payloads"].values():
        found = np.array(row["exact, payload with inertia_hz"])
        assert np.min(np.abs(found - row["paper_hz"][1][1])) < 0.7
