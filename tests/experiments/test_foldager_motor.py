import numpy as np
import pytest

from experiments.foldager_motor.run import run


@pytest.fixture(scope="module")
def figures(tmp_path_factory):
    folder = tmp_path_factory.mktemp("motor")
    found = run(folder, reduced=True)
    assert {p.name for p in folder.iterdir()} == {"steps.png", "sines.png"}
    return found


def test_steps_follow_the_closed_form(figures):
    assert len(figures["step_error"]) == 4
    assert max(figures["step_error"].values()) < 1e-9


def test_sines_follow_the_transfer_functions(figures):
    assert max(figures["sine_error"].values()) < 1e-5


def test_speed_settles_at_the_textbook_value(figures):
    p = figures["parameters"]
    k, r, b = p["torque_constant_N_m_A"], p["resistance_ohm"], p["viscous_friction_N_m_s"]
    np.testing.assert_allclose(figures["final_speed_after_6_V_rad_s"], 6 * k / (r * b + k**2), rtol=1e-9)
    # the time constants add up to (R J + L b) / (R b + K_m K_b), in ms
    j, l = p["inertia_kg_m2"], p["inductance_H"]
    total = 1e3 * (r * j + l * b) / (r * b + k**2)
    np.testing.assert_allclose(sum(figures["open_loop_time_constants_ms"]), total, rtol=1e-9)
