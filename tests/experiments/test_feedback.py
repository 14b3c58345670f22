import numpy as np
import pytest

from experiments.feedback.run import run


@pytest.fixture(scope="module")
def figures(tmp_path_factory):
    return run(tmp_path_factory.mktemp("feedback"), True)


def test_the_strain_gauge_pays(figures):
    laws = figures["continuous"]
    assert laws["LQG"]["residual_vibration_mm"] < laws["PD"]["residual_vibration_mm"] / 2
    assert laws["PD, strain rate"]["slowest_decay_per_s"] > 2 * laws["PD"]["slowest_decay_per_s"] > 0


def test_a_drive_with_an_encoder_does_nearly_as_well(figures):
    for name, law in figures["on a drive"].items():
        ideal = figures["continuous"][name]["residual_vibration_mm"]
        assert law["residual_vibration_mm"] < 1.3 * ideal + 1.0
        assert law["peak_voltage_V"] <= 24.0 + 1e-9


def test_learning_goes_down(figures):
    for errors in figures["learning_rms_joint_error_mrad"].values():
        assert np.all(np.diff(errors) < 0)
