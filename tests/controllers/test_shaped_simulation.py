"""Shapers in the simulation of a link: its ringing mode stays at rest, to the tolerance of the solver."""

from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from controllers import (
    PD,
    Move,
    SCurve,
    Shaped,
    ei,
    matched_s_curve,
    polynomial,
    residual_ratio,
    si,
    um_zv,
    unshaped,
    zv,
    zvdd,
)

DISTANCE = 1e-3  # rad; small, so that the loop is as linear as the theory


@pytest.fixture(scope="module")
def rings():
    """A link under stiff PD and its ringing mode."""
    arm, controller = jf.foldager_link(0.05, modes=1), PD((400.0,), (4.0,))
    modes = jf.closed_loop_modes(jf.linearise(arm, jnp.array([DISTANCE]), controller, ()))
    at = int(jnp.argmin(jnp.where(modes.damping_ratio > 0, modes.damping_ratio, 1.0)))
    return arm, controller, modes.frequency[at], modes.damping_ratio[at]


def test_shapers_leave_what_the_closed_form_says(rings):
    arm, controller, f, zeta = rings
    off = 1.15 * f  # designed for another mode: the closed form says how much is left
    shapers = [
        unshaped(), zv(f, zeta), zvdd(f, zeta), ei(f, zeta, humps=2), um_zv(f, zeta),
        ei(f, zeta), si(f, zeta, 0.3), zv(off, zeta),
    ]  # fmt: skip
    longest = max(float(s.duration()) for s in shapers)
    padded = jax.tree_util.tree_map(lambda *leaves: jnp.stack(leaves), *(s.padded(4) for s in shapers))
    # two whole periods, after modes that the shapers leave alone have died
    start = 0.1 + longest + 0.15
    times = jnp.concatenate([jnp.zeros(1), start + jnp.linspace(0.0, 2 / float(f), 161)])

    @jax.jit
    @jax.vmap
    def run(shaper):
        reference = Shaped(Move((0.0,), (DISTANCE,), 0.1), shaper)
        method = jf.Adaptive(rtol=1e-10, atol=1e-15)
        return jf.simulate(arm, controller, reference, times, method=method, channels=("tip_deflection_1",))

    deflection = np.asarray(run(padded).check()["tip_deflection_1"])[:, 1:]
    omega, t = 2 * np.pi * float(f), np.asarray(times[1:])
    pole = omega * (-float(zeta) + 1j * np.sqrt(1 - float(zeta) ** 2))
    waves = np.exp(pole * (t - t[0]))
    basis = np.stack([waves.real, waves.imag, np.ones_like(t)], axis=1)
    left = np.linalg.norm(np.linalg.lstsq(basis, deflection.T)[0][:2], axis=0)
    ends = np.array([float(s.duration()) for s in shapers])
    # the closed form is the share at the end of each shaper of what an impulse makes at its beginning
    decayed = np.exp(-pole.real * ends)
    said = np.array([float(residual_ratio(s, f, zeta)) for s in shapers]) * decayed
    np.testing.assert_allclose(left / left[0], said, rtol=1e-3, atol=1e-6)


def test_smooth_commands_cancel_a_mode_in_closed_form():
    # an oscillator without damping driven by the move, by quadrature of exp(j w t) over its acceleration
    w = 2 * np.pi * 3.0
    places, weights = np.polynomial.legendre.leggauss(60)

    def left(move, knots):
        total = 0.0
        for a, b in pairwise(knots):
            t = (a + b) / 2 + (b - a) / 2 * places
            acceleration = np.asarray(jax.vmap(lambda t: move.setpoint(t).acceleration[0])(jnp.asarray(t)))
            total += np.sum(weights * (b - a) / 2 * acceleration * np.exp(1j * w * t))
        return abs(total) / w

    curve = matched_s_curve((0.0,), (1.0,), 3.0)
    knots = np.asarray(curve.jumps())
    np.testing.assert_allclose(float(curve.duration), 2 / 3, rtol=1e-12)
    assert left(curve, knots) < 1e-12
    other = Move((0.0,), (1.0,), 0.75 * curve.duration, SCurve())
    assert left(other, 0.75 * knots) > 0.1
    longer = matched_s_curve((0.0,), (1.0,), 3.0, shortest=1.0)
    np.testing.assert_allclose(float(longer.duration), 4 / 3, rtol=1e-12)
    # the kernel of second order makes the quintic of a step: 1.83 periods, the first zero of j_2
    np.testing.assert_allclose(float(polynomial(3.0, 0.0, 2).duration()) * 3, 5.763459 / np.pi, rtol=1e-6)
