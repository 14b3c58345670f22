import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import jaxflex as jf
from controllers import CLASSICAL, PD, Move, Shaped, convolve, ei, residual_ratio, unshaped, zv, zvd, zvdd


@settings(max_examples=40, deadline=None)
@given(st.floats(0.2, 30.0), st.floats(0.0, 0.6))
def test_zero_vibration_shapers_cancel_their_mode(frequency, zeta):
    for make in (zv, zvd, zvdd):
        shaper = make(frequency, zeta)
        np.testing.assert_allclose(residual_ratio(shaper, frequency, zeta), 0.0, atol=1e-12)
        np.testing.assert_allclose(shaper.amplitudes.sum(), 1.0, rtol=1e-12)


@pytest.mark.parametrize("make, order", [(zv, 1), (zvd, 2), (zvdd, 3)])
def test_insensitivity_is_of_the_order_of_the_shaper(make, order):
    shaper = make(1.0)
    near = [float(residual_ratio(shaper, 1.0 + d)) for d in (1e-2, 5e-3)]
    np.testing.assert_allclose(np.log2(near[0] / near[1]), order, atol=0.05)


def test_five_percent_insensitivity_of_the_textbooks():
    # Singhose et al.: 5 % insensitivity of ZV 0.06, ZVD 0.29, EI 0.40 (undamped)
    f = jnp.linspace(0.5, 1.5, 20001)
    for shaper, width in ((zv(1.0), 0.064), (zvd(1.0), 0.286), (ei(1.0), 0.399)):
        low = jax.vmap(lambda x, s=shaper: residual_ratio(s, x))(f) <= 0.05 + 1e-9
        np.testing.assert_allclose(low.mean(), width, atol=4e-3)


@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.2])
def test_ei_leaves_its_tolerance_at_the_mode(zeta):
    np.testing.assert_allclose(residual_ratio(ei(2.0, zeta), 2.0, zeta), 0.05, rtol=1e-9)
    assert np.all(np.asarray(ei(2.0, 0.7).amplitudes) >= 0)


def test_convolution_cancels_both_modes():
    both = convolve(zv(1.0, 0.02), zvd(3.7, 0.1))
    for mode in ((1.0, 0.02), (3.7, 0.1)):
        np.testing.assert_allclose(residual_ratio(both, *mode), 0.0, atol=1e-12)
    assert np.all(np.diff(both.delays) >= 0) and both.delays.shape == (6,)


def test_closed_form_residual_is_that_of_an_oscillator():
    zeta, f = 0.03, 1.3
    shaper = zv(1.1, 0.0)
    omega = 2 * np.pi * f
    damped = omega * np.sqrt(1 - zeta**2)

    def ring(t):
        return np.exp(-zeta * omega * t) * np.exp(1j * damped * t)

    end = float(shaper.duration())
    total = sum(
        a * ring(end - t)
        for a, t in zip(np.asarray(shaper.amplitudes), np.asarray(shaper.delays), strict=True)
    )
    np.testing.assert_allclose(residual_ratio(shaper, f, zeta), abs(total), rtol=1e-12)


def test_shaper_cancels_the_ringing_of_a_simulated_link():
    # a nearly massless hub under stiff PD: the link rings in its clamped mode, and ZV takes that away
    arm = jf.foldager_link(0.05, modes=1)
    controller = PD((400.0,), (4.0,))
    modes = jf.closed_loop_modes(jf.linearise(arm, jnp.array([0.2]), controller, ()))
    ringing = int(jnp.argmin(jnp.where(modes.damping_ratio > 0, modes.damping_ratio, 1.0)))
    f, zeta = modes.frequency[ringing], modes.damping_ratio[ringing]
    times = jnp.linspace(0.0, 1.0, 1001)
    left = {}
    for name, shaper in (("none", unshaped()), ("ZV", zv(f, zeta))):
        reference = Shaped(Move((0.0,), (0.02,), 0.1), shaper)
        run = jf.simulate(arm, controller, reference, times, method=jf.Adaptive(rtol=1e-9, atol=1e-11))
        # a tenth of a second later the well damped modes, which the shaper leaves alone, are gone
        late = run["tip_deflection_1"][times > 0.2 + float(shaper.duration())]
        left[name] = float(jnp.ptp(late))
    assert left["ZV"] < 1e-3 * left["none"]


def test_padding_changes_nothing():
    shaper = zvd(1.3, 0.1)
    np.testing.assert_allclose(residual_ratio(shaper.padded(6), 1.1, 0.1), residual_ratio(shaper, 1.1, 0.1))
    with pytest.raises(ValueError, match="more than 2"):
        shaper.padded(2)
    assert set(CLASSICAL) == {"ZV", "ZVD", "ZVDD", "EI"}


def test_settings_have_gradients():
    slope = jax.grad(lambda f: residual_ratio(zvd(f, 0.05), 1.2, 0.05))
    h = 1e-6
    difference = (
        residual_ratio(zvd(1.0 + h, 0.05), 1.2, 0.05) - residual_ratio(zvd(1.0 - h, 0.05), 1.2, 0.05)
    ) / (2 * h)
    np.testing.assert_allclose(slope(1.0), difference, rtol=1e-6)
