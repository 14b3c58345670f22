import numpy as np
import pytest

from experiments.shaper_insensitivity.run import run


@pytest.mark.slow  # tests/controllers/test_shapers.py holds the same figures
def test_insensitivities_are_those_published(tmp_path):
    figures = run(tmp_path, reduced=True)
    assert {p.name for p in tmp_path.iterdir()} == {"curves.png", "costs.png"}
    for row in figures["shapers"].values():
        if row["published"] is not None:
            np.testing.assert_allclose(row["insensitivity"], row["published"], atol=0.015)
        assert row["insensitivity_damped"] > row["insensitivity"]
