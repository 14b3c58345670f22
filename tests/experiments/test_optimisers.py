import numpy as np
import pytest

from experiments.optimisers.methods import METHODS
from experiments.optimisers.run import run


@pytest.fixture(scope="module")
def figures(tmp_path_factory):
    return run(tmp_path_factory.mktemp("optimisers"), True)


def test_every_method_improves_and_is_given_the_same(figures):
    assert set(figures["methods"]) == set(METHODS)
    for method in figures["methods"].values():
        costs = np.median(method["cost_at_equal_simulations"], axis=1)
        assert np.all(np.diff(costs) <= 0) and costs[-1] < costs[0]


def test_the_gradient_leads_at_equal_simulations(figures):
    reached = {
        name: np.median(method["cost_at_equal_simulations"][-1])
        for name, method in figures["methods"].items()
    }
    assert reached["gradient (BFGS)"] == min(reached.values())
