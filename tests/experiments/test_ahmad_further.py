import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from experiments.ahmad_further.arms import STANDARD_GRAVITY, sag, three_links, tilted
from experiments.ahmad_further.run import run


@pytest.fixture(scope="module")
def figures(tmp_path_factory):
    return run(tmp_path_factory.mktemp("ahmad_further"), True)


def test_sag_of_one_link_is_that_of_the_textbook():
    # a cantilever under its own weight and a mass at its tip: w l^4 / 8 EI + P l^3 / 3 EI
    arm = jf.Arm((jf.Link(0.5, 0.2, 1.0, modes=4),), (jf.Joint(0.02),), jf.Payload(0.1))
    load = STANDARD_GRAVITY * np.sin(np.deg2rad(2.0))
    exact = load * (0.2 * 0.5**4 / 8 + 0.1 * 0.5**3 / 3)
    np.testing.assert_allclose(sag(tilted(arm, 2.0))[0], -exact / 0.5, rtol=1e-4)


@pytest.mark.slow
def test_the_arm_cannot_carry_itself_upright(figures):
    assert abs(figures["sag_pct_of_length"]["two links, base tilted by 90 deg"][0]) > 50


@pytest.mark.slow
def test_a_heavier_payload_drags_a_tilted_arm_further_from_its_target(figures):
    for design in figures["designs"]["two links, base tilted by 1 deg"].values():
        assert np.all(np.diff(design["residual_vibration_mm"]) > 0)
        assert max(design["peak_voltage_V"]) <= 24.0


@pytest.mark.slow
def test_three_links_are_an_arm_of_three(figures):
    arm = three_links(0.05)
    rigid = jf.driven_frequencies(arm, jnp.array([0.3, 0.4, -0.5]))[:3]
    np.testing.assert_allclose(rigid, 0.0, atol=1e-4)
    frequencies = figures["frequencies_hz"]
    assert frequencies["three links"]["joints locked"][0] < frequencies["two links"]["joints locked"][0]
