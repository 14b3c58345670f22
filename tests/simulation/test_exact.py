import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from controllers import (
    PD,
    BangBang,
    Filtered,
    Move,
    OpenLoop,
    Sampled,
    SCurve,
    Shaped,
    Shaper,
    Step,
    notch,
    zvd,
)
from jaxflex.effects import CableStiffness, CoulombFriction, InputDelay, PeriodicDisturbance
from jaxflex.simulation.exact import suits
from jaxflex.simulation.plant import Plant
from jaxflex.simulation.simulate import InitialState, initial_state

TIMES = jnp.linspace(0.0, 0.8, 81)
LINK = jf.foldager_link(0.02, modes=2).linear()
GAINS = PD((10.0,), (0.3,), (0.05,), (0.01,))
MOVE = Shaped(Move((0.0,), (0.5,), 0.3, begin=0.0137), zvd(9.0, 0.01))
CHANNELS = ["angle_1", "tip_y", "tip_deflection_1"]


def free(arm):
    """Driven by a torque and without friction: two poles at zero, of one eigenvector."""
    joint = dataclasses.replace(arm.joints[0], viscous_friction=jf.scalar(0.0))
    return dataclasses.replace(arm, drive="torque", joints=(joint,))


UNEVEN = 0.1 + 0.8 * jnp.linspace(0.0, 1.0, 23) ** 1.7
CASES = {
    "shaped quintic, feedforward": (LINK, GAINS, MOVE, TIMES, {}),
    "torque on a free joint, the last time alone": (
        free(LINK), OpenLoop(), BangBang((0.02,), 0.2371), jnp.array([0.0, 0.8]), {},
    ),
    "lumped link, S-curve, samples that are held as disturbance": (
        jf.foldager_link(0.01, modes=2, model="lumped", segments=14).linear(),
        GAINS, Move((0.0,), (0.3,), 0.25, SCurve()), TIMES,
        {"disturbance": Sampled(jnp.arange(40) * 0.017, 1e-2 * jnp.sin(jnp.arange(40.0))[:, None], "hold")},
    ),
    "uneven times, start, effects, memory of the controller": (
        dataclasses.replace(LINK, effects=(CableStiffness(0.02), InputDelay(2e-3))),
        Filtered(PD((10.0,), (0.3,)), (notch(34.0),)), MOVE, UNEVEN,
        {"initial": jf.InitialState(jnp.array([0.1]), jnp.array([-1.0]), jnp.array([1e-3, 0.0]))},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", list(CASES))
def test_agrees_with_the_integrator(name):
    arm, controller, reference, times, options = CASES[name]
    run, by_steps = (
        jf.simulate(arm, controller, reference, times, method=method, channels=CHANNELS, **options)
        for method in (jf.Exact(), jf.Fixed(2e-5))
    )
    assert float(jnp.abs(run["angle_1"]).max()) > 0.02
    for channel in CHANNELS:
        np.testing.assert_allclose(run[channel], by_steps[channel], atol=1e-9, err_msg=channel)


def test_finer_times_change_nothing_and_it_is_the_default():
    fine = jf.simulate(LINK, GAINS, MOVE, jnp.linspace(0.0, 0.8, 1601), channels=CHANNELS)
    run = jf.simulate(LINK, GAINS, MOVE, TIMES, channels=CHANNELS, method=jf.Exact())
    for channel in CHANNELS:
        np.testing.assert_allclose(run[channel], fine[channel][::20], atol=1e-12)


def chosen(arm, controller=GAINS, reference=MOVE, sample_time=None):
    plant = Plant(arm.assemble(), controller, reference, None, sample_time)
    return suits(plant, initial_state(plant, InitialState()))


def test_is_chosen_where_the_loop_is_linear_and_nowhere_else():
    assert chosen(LINK)
    assert chosen(jf.Arm((), (jf.Joint(hub_inertia=0.02),)))
    assert chosen(dataclasses.replace(LINK, effects=(CableStiffness(0.02),)))
    for limited in (
        jf.foldager_link(0.02, modes=2),
        dataclasses.replace(LINK, gravity=jf.scalar(9.81)),
        dataclasses.replace(LINK, joints=jf.foldager_link().joints),
        dataclasses.replace(LINK, effects=(CoulombFriction(0.0),)),
        dataclasses.replace(LINK, effects=(PeriodicDisturbance(0.1),)),
    ):
        assert not chosen(limited)
    assert not chosen(LINK, sample_time=jf.scalar(1e-3))
    assert not chosen(LINK, reference=Sampled(TIMES, jnp.sin(TIMES)[:, None]))
    assert not chosen(jf.ahmad_arm(modes=0, drive="torque"), OpenLoop(), BangBang((0.2, 0.1)))


def test_what_it_cannot_do_is_said():
    with pytest.raises(ValueError, match=r"needs a linear loop.*arm.linear\(\)"):
        jf.simulate(jf.foldager_link(), GAINS, MOVE, TIMES, method=jf.Exact())
    with pytest.raises(ValueError, match="continuous control"):
        jf.simulate(LINK, GAINS, MOVE, TIMES, method=jf.Exact(), sample_time=1e-3)
    with pytest.raises(jf.SimulationError, match="no polynomial of time"):
        smooth = Sampled(TIMES, jnp.sin(9 * TIMES)[:, None])
        jf.simulate(LINK, GAINS, smooth, TIMES, method=jf.Exact())
    with pytest.raises(ValueError, match="2 joints"):
        jf.ahmad_arm().linear()


def final(stiffness, delay, payload, begin, stop):
    shaper = Shaper(jnp.array([0.6, 0.4]), jnp.stack([jnp.zeros(()), delay]))
    move = Shaped(Step((0.0,), (0.3,), begin), shaper)
    times = jnp.linspace(0.0, stop, 41)
    gains = PD((stiffness,), (0.3,))
    run = jf.simulate(LINK.with_payload(payload), gains, move, times, channels=["tip_y", "angle_1"])
    return run["tip_y"][-1] + run["angle_1"][30]


def test_derivatives_in_both_modes():
    # the step falls on one of the times, its echo between two
    point = tuple(jnp.asarray(x) for x in (10.0, 0.0437, 0.02, 0.1, 0.4))
    every = tuple(range(5))
    ahead = jax.jit(jax.jacfwd(final, every))(*point)
    back = jax.jit(jax.grad(final, every))(*point)
    np.testing.assert_allclose(back, ahead, rtol=1e-9)
    value = jax.jit(final)
    for i, slope in enumerate(ahead):
        h = 1e-6 * jnp.zeros(5).at[i].set(1.0)
        difference = (value(*(jnp.array(point) + h)) - value(*(jnp.array(point) - h))) / 2e-6
        assert abs(float(slope)) > 1e-4
        np.testing.assert_allclose(slope, difference, rtol=1e-6, err_msg=f"argument {i}")


def test_a_batch_is_the_runs_one_by_one_and_nothing_is_retraced():
    traces = []

    @jax.jit
    def batch(payloads):
        traces.append(1)
        return jax.vmap(lambda m: jf.simulate(LINK.with_payload(m), GAINS, MOVE, TIMES, channels=CHANNELS))(
            payloads
        )

    payloads = jnp.array([0.0, 0.03])
    runs = batch(payloads)
    batch(payloads + 0.01)
    assert len(traces) == 1
    for i in range(2):
        alone = jf.simulate(LINK.with_payload(payloads[i]), GAINS, MOVE, TIMES, channels=CHANNELS)
        np.testing.assert_allclose(runs["tip_y"][i], alone["tip_y"], atol=1e-12)


def test_small_motion_leaves_out_what_deflections_add_to_the_inertia(tmp_path):
    finite = jf.foldager_link(0.02, modes=2)
    q, qd = (0.3, 0.01, 0.002), (2.0, 0.1, -0.05)
    scalars = [tuple(map(jf.scalar, values)) for values in (q, qd)]
    whole, small = (jf.kinetic_energy(a.assemble(), *scalars) for a in (finite, LINK))
    # 1/2 omega^2 (int rho w^2 dx + M w(l)^2), what the shapes are normalised with
    model = finite.assemble()
    spread = jf.mass_matrix(model, jnp.zeros(3))[1:, 1:]
    eta = jnp.array(q[1:])
    np.testing.assert_allclose(whole - small, 0.5 * qd[0] ** 2 * eta @ spread @ eta, rtol=1e-9)
    still = tuple(map(jf.scalar, (0.3, 0.0, 0.0)))
    np.testing.assert_allclose(*(jf.kinetic_energy(a.assemble(), still, scalars[1]) for a in (finite, LINK)))
    jf.save_arm(LINK, tmp_path / "arm.toml")
    assert jf.load_arm(tmp_path / "arm.toml").links[0].motion == "small"
    with pytest.raises(ValueError, match="motion = 'smaller'"):
        jf.Link(1.0, 1.0, 1.0, motion="smaller")
    with pytest.raises(ValueError, match="one joint"):
        arm = jf.ahmad_arm()
        dataclasses.replace(arm, links=tuple(dataclasses.replace(x, motion="small") for x in arm.links))
    assert eqx.tree_equal(LINK.linear(), LINK)
