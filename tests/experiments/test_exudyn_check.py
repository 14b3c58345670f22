import numpy as np
import pytest

pytest.importorskip("exudyn", reason="exudyn is not installed: pip install -e '.[exudyn]'")


@pytest.fixture(scope="module")
def figures(tmp_path_factory):
    from experiments.exudyn_check.run import run

    return run(tmp_path_factory.mktemp("exudyn_check"), True)


def test_frequencies_agree_within_a_hundredth(figures):
    assert len(figures["frequencies"]) == 4
    assert figures["worst_frequency_difference_pct"] < 1.0


def test_difference_of_the_frequencies_is_that_of_the_elements(figures):
    coarse, middle, fine = figures["frequency_difference_pct_by_elements"].values()
    np.testing.assert_allclose([coarse / middle, middle / fine], 4.0, rtol=0.1)


def test_tips_agree_within_a_fiftieth_of_their_span(figures):
    for case in figures["small_motion"].values():
        assert case["deflection_share_pct"] > 0.9
        assert case["tip_error_pct_of_span"] < 2.0


def test_stiffening_carries_the_model_to_fast_hubs_and_large_deflections(figures):
    slow, fast = figures["spin"]
    assert 0.02 < 1 - slow["jaxflex"] / slow["Exudyn"] < 0.1
    assert fast["jaxflex"] is None  # beyond the first frequency the plain link diverges
    for spin in (slow, fast):
        stiff = spin["jaxflex with centrifugal stiffening"]
        np.testing.assert_allclose(stiff, spin["Exudyn"], rtol=5e-3)
    far = figures["large_motion"]["one link shaken"][-1]
    plain, stiff = (v for k, v in far.items() if k.startswith("tip_error"))
    assert stiff < plain / 3
