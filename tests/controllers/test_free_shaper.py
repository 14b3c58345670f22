"""Free motion after a move, against the simulation; the tuned free shaper against a known optimum."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from controllers import (
    FreeMotion,
    Move,
    Shaped,
    Shaper,
    free_motion,
    shaped_residual,
    step_motion,
    textbook_pd,
    tip_after,
    tune_shaper,
    zv,
)


@pytest.fixture(scope="module")
def loop():
    arm = jf.foldager_link(0.02, modes=1)
    move = Move((0.0,), (1e-3,), 0.15)
    pd = textbook_pd(arm, jnp.array([1e-3]), 30.0, feedforward=True)
    return arm, pd, move, free_motion(arm, pd, move)


def test_the_tip_after_a_shaped_move_is_that_of_the_simulation(loop):
    arm, pd, move, motion = loop
    shaper = Shaper(jnp.array([0.3, 0.5, 0.2]), jnp.array([0.0, 0.04, 0.09]))
    after = jnp.linspace(0.0, 0.3, 31)
    times = jnp.concatenate([jnp.zeros(1), move.end() + shaper.duration() + after])
    method = jf.Adaptive(rtol=1e-9, atol=1e-13)
    run = jf.simulate(arm, pd, Shaped(move, shaper), times, method=method)
    rest = jf.tip_position(arm, jnp.stack(move.stop))
    path = np.asarray(run.tip)[1:] - rest
    said = tip_after(motion, shaper, after)
    # across the arm; along it the tip moves by the square of the angle
    np.testing.assert_allclose(said[:, 1], path[:, 1], atol=2e-5 * np.abs(path).max())
    box = jf.residual_vibration(after, said, 0.0, jnp.zeros(2))
    np.testing.assert_allclose(shaped_residual(motion, shaper, after), box)


def test_a_step_of_the_reference_starts_at_the_old_place(loop):
    arm, pd, *_ = loop
    motion = step_motion(arm, pd, jnp.array([0.0]), jnp.array([1e-3]))
    first = jnp.real(motion.tip.sum(axis=1))
    np.testing.assert_allclose(first[1], -1e-3 * arm.links[0].length, rtol=1e-5)


def test_derivatives_in_delays_and_amplitudes(loop):
    motion = loop[3]
    times = jnp.linspace(0.0, 0.3, 31)

    def value(parts):
        return shaped_residual(motion, Shaper(*parts), times)

    parts = (jnp.array([0.4, 0.35, 0.25]), jnp.array([0.0, 0.03, 0.08]))
    slopes = jax.jit(jax.grad(value))(parts)
    for which in range(2):
        for i in range(3):
            step = eqx.tree_at(
                lambda p, w=which: p[w], (jnp.zeros(3), jnp.zeros(3)), jnp.zeros(3).at[i].set(1e-7)
            )
            high = value(jax.tree_util.tree_map(jnp.add, parts, step))
            low = value(jax.tree_util.tree_map(jnp.subtract, parts, step))
            np.testing.assert_allclose(slopes[which][i], (high - low) / 2e-7, rtol=1e-4, atol=1e-9)


def test_one_undamped_mode_is_brought_to_rest():
    # a shaper longer than ZV can leave nothing at all of one mode, and of two modes little
    pole = 2j * jnp.pi * 3.0
    poles = jnp.stack([pole, -pole])
    tip = jnp.array([[0.0, 0.0], [0.5, 0.5]], dtype=complex)
    one = FreeMotion(poles[None], tip[None])
    times = jnp.linspace(0.0, 1.0, 61)
    found = tune_shaper(one, 0.2, times, impulses=4, starts=2, max_steps=100)
    assert found.worst < 2e-3 * 2
    member = FreeMotion(poles, tip)
    np.testing.assert_allclose(shaped_residual(member, zv(3.0), times), 0.0, atol=1e-12)
    np.testing.assert_allclose(found.shaper.amplitudes.sum(), 1.0, rtol=1e-12)
    np.testing.assert_allclose(found.shaper.duration(), 0.2, rtol=1e-12)
