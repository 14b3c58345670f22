import pytest

from experiments.shaper_optimum.run import run


@pytest.fixture(scope="module")
def figures(tmp_path_factory):
    folder = tmp_path_factory.mktemp("optimum")
    found = run(folder, reduced=True)
    assert {p.name for p in folder.iterdir()} == {"impulses.png", "motion.png"}
    return found


def test_the_tuned_shaper_is_within_five_percent_of_the_optimum(figures):
    assert {"single link", "two-link arm, stiff joints"} <= set(figures)
    for case in figures.values():
        for row in case["rows"]:
            assert row["standard_start_over_optimum"] < 1.05
            assert row["tuned_over_optimum"] < 1.05
            # impulses on a grid bound it from above, the gradient is free in time
            assert row["tuned_over_optimum"] > 0.99
            assert row["optimum_mm"] < 0.7 * row["unshaped_mm"]
