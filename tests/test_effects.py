import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from controllers import OpenLoop, Step
from jaxflex.effects import (
    EFFECTS,
    AbstractJointEffect,
    AsymmetricFriction,
    Backlash,
    CableStiffness,
    CentrifugalStiffening,
    CoulombFriction,
    InputDelay,
    JointFlexibility,
    LoadTorqueBias,
    RootCompliance,
)
from jaxflex.effects.friction import SMALL, fading

SIZE = {
    "gap": 0.01, "limit": 2.0, "width": 0.3, "delay": 0.01, "change": 0.02, "mass": 0.02,
    "inertia": 1e-3, "compliance": 0.02, "along_y": 2.0, "ratio": 0.05, "share": 1.0,
    "bias": 0.1, "error": 0.1, "lag": 0.02, "rate": 0.05,
}  # fmt: skip
JOINT_EFFECTS = [name for name, kind in EFFECTS.items() if issubclass(kind, AbstractJointEffect)]


def make(name, size):
    kind = EFFECTS[name]
    first = next(iter(kind.units))
    return kind(size * SIZE.get(first, 0.2))


def rig(*effects):
    motor = jf.DCMotor(1.2, 0.06, 0.06, inductance=1.5e-3)
    link = jf.Link(0.4, 0.15, 0.7, damping_ratio=0.01, modes=1)
    joint = jf.Joint(hub_inertia=1e-3, viscous_friction=2e-4, motor=motor)
    return jf.Arm((link,), (joint,), jf.Payload(0.02), drive="voltage", effects=effects)


@pytest.mark.parametrize("name", JOINT_EFFECTS)
def test_torques_vanish_at_zero_and_have_finite_gradients_at_rest(name):
    zero, rest = jnp.zeros(()), jnp.array(0.3)
    assert make(name, 0.0)(rest, jnp.array(1.5), rest) == 0.0
    slopes = jax.grad(lambda s, a, v: make(name, s)(a, v, a), (0, 1, 2))(1.0, rest, zero)
    assert np.isfinite(slopes).all()
    assert make(name, 1.0).name == name and make(name, 1.0).index == 0


def turned(*effects):
    """Angle of the rig after a step, from rest at an angle: gravity and springs have something to do."""
    start = jf.InitialState(angles=jnp.array([0.5]), rates=jnp.array([0.1]))
    times, step = jnp.linspace(0.0, 0.8, 81), Step((0.0,), (4.0,), 0.1)
    run = jf.simulate(rig(*effects), OpenLoop(), step, times, initial=start, channels=("angle_1",))
    return run["angle_1"]


def test_every_effect_acts_and_is_absent_at_zero():
    names = [name for name in EFFECTS if name != "backlash"]  # without a gap its flanks still give way
    strong = {"centrifugal_stiffening": 5.0}

    @jax.jit
    @jax.vmap
    def run(sizes):
        return turned(*(make(name, size) for name, size in zip(names, sizes, strict=True)))

    one_each = jnp.diag(jnp.array([strong.get(name, 1.0) for name in names]))
    none, *each = run(jnp.concatenate([jnp.zeros((1, len(names))), one_each]))
    nominal = turned()
    np.testing.assert_allclose(none, nominal, atol=2e-5)
    for name, changed in zip(names, each, strict=True):
        assert np.isfinite(changed).all(), name
        assert np.abs(changed - nominal).max() > 1e-4, name


@pytest.mark.parametrize("name", ["backlash", "coulomb_friction", "gravity", "sensor_lag"])
def test_an_effect_acts_alone(name):
    assert np.abs(turned(make(name, 1.0)) - turned()).max() > 1e-4


@pytest.mark.parametrize("model", ["assumed_modes", "lumped"])
def test_a_clamp_that_gives_way_is_a_spring_at_the_root(model):
    """Against an arm whose joint is free, but for a spring: the same frequencies."""
    link = jf.Link(0.4, 0.15, 0.7, modes=4, model=model, segments=8)
    arm = jf.Arm((link,), (jf.Joint(hub_inertia=1e-9),), jf.Payload(0.02))
    spring = 20.0
    held = jf.driven_frequencies(arm, joint_stiffness=jnp.array([spring]))
    for effect in (RootCompliance(1 / spring), JointFlexibility(1 / spring)):
        soft = dataclasses.replace(arm, effects=(effect,))
        np.testing.assert_allclose(jf.locked_frequencies(soft)[:2], held[:2], rtol=2e-6)


def test_shortening_gives_the_known_stiffness_of_a_turning_beam():
    """Southwell: a clamped beam turning at W in its plane of bending has w^2 = w0^2 + (1.193 - 1) W^2."""
    link = jf.Link(1.0, 0.3, 2.0, modes=3, mode_shapes="clamped_free")
    hub = jf.Joint(hub_inertia=1e6)

    def lowest(rate, *effects):
        arm = jf.Arm((link,), (hub,), effects=effects).assemble()
        qd = jnp.array([rate, 0.0, 0.0, 0.0])
        stiffness = -jax.hessian(lambda q: jf.lagrangian(arm, q, qd))(jnp.zeros(4))[1:, 1:]
        mass = jf.mass_matrix(arm, jnp.zeros(4))[1:, 1:]
        return jnp.linalg.eigvals(jnp.linalg.solve(mass, stiffness)).real.min()

    rate = 2.0
    still = lowest(0.0)
    assert (lowest(rate) - still) / rate**2 == pytest.approx(-1.0, abs=1e-6)
    full = (lowest(rate, CentrifugalStiffening(1.0)) - still) / rate**2
    assert full == pytest.approx(0.193, abs=0.003)


def test_a_delay_is_a_delay():
    late = rig(InputDelay(0.02))
    times = jnp.linspace(0.0, 0.6, 121)
    on_time = jf.simulate(rig(), OpenLoop(), Step((0.0,), (2.0,), 0.12), times)["angle_1"]
    delayed = jf.simulate(late, OpenLoop(), Step((0.0,), (2.0,), 0.1), times)["angle_1"]
    np.testing.assert_allclose(delayed, on_time, atol=2e-3 * float(on_time.max()))


def test_play_keeps_its_energy_and_lets_the_link_turn_freely():
    """The link crosses its gap at constant rate, then bounces back elastically."""
    arm = jf.Arm(
        (jf.Link(0.4, 0.15, 200.0, modes=1),), (jf.Joint(hub_inertia=50.0),), jf.Payload(0.02),
        effects=(Backlash(0.1, contact_stiffness=2000.0),),
    )  # fmt: skip
    start = jf.InitialState(deflection_rates=jnp.array([0.0, 1.0]))
    times = jnp.linspace(0.0, 0.04, 5)
    run = jf.simulate(
        arm, OpenLoop(), Step((0.0,), (0.0,)), times, initial=start, method=jf.Adaptive(rtol=1e-9)
    )
    # a turn is followed to its second order; left out is `eta^3 / 6`, that of a sine, at most
    np.testing.assert_allclose(run.state.q[2], times, rtol=0.04**2 / 6, atol=1e-9)
    model = arm.assemble()

    def energy(q, qd):
        return jf.kinetic_energy(model, q, qd) + jf.potential_energy(model, q)

    later = jf.simulate(
        arm, OpenLoop(), Step((0.0,), (0.0,)), jnp.linspace(0, 0.3, 61), initial=start,
        method=jf.Adaptive(rtol=1e-10, atol=1e-12),
    )  # fmt: skip
    total = jax.vmap(energy)(later.state.q, later.state.qd)
    np.testing.assert_allclose(total, total[0], rtol=1e-5)
    assert np.abs(later.state.q[2]).max() < 0.06


SPLIT = {"hub_inertia": 0.05, "contact_stiffness": 40.0, "motor_share": 0.3}


def test_a_bare_axis_with_a_spring_is_two_inertias():
    """`w^2 = k (1/J_1 + 1/J_2)`, between rotor and load, and a joint flexibility in series with k."""
    arm = jf.Arm((), (jf.Joint(play=0.0, **SPLIT),))
    rotor, load = 0.3 * 0.05, 0.7 * 0.05
    for compliance in (0.0, 0.02):
        soft = dataclasses.replace(arm, effects=(JointFlexibility(compliance),)) if compliance else arm
        frequency = jnp.sqrt(1 / (1 / 40.0 + compliance) * (1 / rotor + 1 / load)) / (2 * jnp.pi)
        np.testing.assert_allclose(jf.driven_frequencies(soft)[1], frequency, rtol=1e-9)


def test_a_bare_axis_crosses_its_play_and_keeps_its_momentum():
    arm = jf.Arm((), (jf.Joint(play=0.1, **SPLIT),))
    start = jf.InitialState(deflection_rates=jnp.array([1.0]))
    times = jnp.linspace(0.0, 0.3, 61)
    run = jf.simulate(
        arm,
        OpenLoop(),
        Step((0.0,), (0.0,)),
        times,
        initial=start,
        method=jf.Adaptive(rtol=1e-10, atol=1e-12),
    )
    crossing = times < 0.05
    np.testing.assert_allclose(run.state.q[1][crossing], times[crossing], atol=1e-9)
    np.testing.assert_allclose(run["angle_1"][crossing], 0.0, atol=1e-12)
    rotor_rate, load_rate = run.state.qd[0], run.state.qd[0] + run.state.qd[1]
    momentum = 0.05 * (0.3 * rotor_rate + 0.7 * load_rate)
    np.testing.assert_allclose(momentum, 0.05 * 0.7, rtol=1e-7)
    assert np.abs(rotor_rate).max() > 0.5  # the flank was hit


def test_a_rigid_link_with_play_is_the_limit_of_a_stiff_one():
    joint = jf.Joint(play=0.02, **SPLIT)
    stiff, rigid = (jf.Arm((jf.Link(0.4, 0.15, 1e6, modes=m),), (joint,), jf.Payload(0.02)) for m in (1, 0))
    several = jf.mass_matrix(stiff.assemble(), jnp.zeros(3))
    two = jf.mass_matrix(rigid.assemble(), jnp.zeros(2))
    np.testing.assert_allclose(two, several[jnp.ix_(jnp.array([0, 2]), jnp.array([0, 2]))], rtol=1e-6)


def test_play_at_a_lumped_link_is_refused():
    arm = jf.Arm((jf.Link(0.4, 0.15, 0.7, model="lumped"),), (jf.Joint(play=0.02, **SPLIT),))
    with pytest.raises(ValueError, match="lumped link has no play"):
        arm.assemble()


@pytest.mark.parametrize("name", ["coulomb_friction", "stribeck_friction", "quadratic_drag"])
def test_friction_takes_energy(name):
    rates, zero = jnp.linspace(-2.0, 2.0, 41), jnp.zeros(())
    power = jax.vmap(lambda v: make(name, 1.0)(zero, v, zero) * v)(rates)
    assert np.all(np.asarray(power) <= 0) and power.min() < 0


def test_coulomb_friction_stops_an_axis_at_constant_deceleration():
    arm = jf.Arm((), (jf.Joint(hub_inertia=0.1),), effects=(CoulombFriction(0.2, transition_rate=1e-4),))
    start = jf.InitialState(rates=jnp.array([1.0]))
    times = jnp.linspace(0.0, 0.4, 21)
    run = jf.simulate(arm, OpenLoop(), Step((0.0,), (0.0,)), times, initial=start)
    np.testing.assert_allclose(run["rate_1"], 1.0 - 2.0 * times, atol=1e-5)


BRISTLE = CoulombFriction(0.2, 1e-6, presliding=2e-3)


def test_a_bristle_bends_with_the_way_gone():
    """`z = 1 - exp(-x / s)` from rest, whatever the speed (Dahl 1968)."""
    arm = jf.Arm((), (jf.Joint(hub_inertia=0.1),), effects=(BRISTLE,))
    start, times = jf.InitialState(rates=jnp.array([0.3])), jnp.linspace(0.0, 0.05, 21)
    run = jf.simulate(arm, OpenLoop(), Step((0.0,), (0.0,)), times, initial=start)
    assert run.state is not None and run.state.joint is not None
    np.testing.assert_allclose(run.state.joint[0], 1 - np.exp(-run["angle_1"] / 2e-3), atol=2e-5)


def test_a_bristle_holds_an_axis_as_a_spring_of_its_slope():
    """Small motion at rest: `w = sqrt(T / (s I))`, `v_t / s` of damping (here none)."""
    arm = jf.Arm((), (jf.Joint(hub_inertia=0.1),), effects=(BRISTLE,))
    start, times = jf.InitialState(rates=jnp.array([1e-4])), jnp.linspace(0.0, 0.4, 101)
    run = jf.simulate(arm, OpenLoop(), Step((0.0,), (0.0,)), times, initial=start)
    w = np.sqrt(0.2 / 2e-3 / 0.1)
    np.testing.assert_allclose(run["angle_1"], 1e-4 / w * np.sin(w * times), atol=3e-8)


def test_a_damped_bristle_holds_an_axis_as_a_damped_spring():
    """Small motion at rest: a spring `T / s` with the damping `d T / s`."""
    damping, inertia = 5e-3, 0.1
    bristle = CoulombFriction(0.2, 1e-9, presliding=2e-3, bristle_damping=damping)
    arm = jf.Arm((), (jf.Joint(hub_inertia=inertia),), effects=(bristle,))
    start, times = jf.InitialState(rates=jnp.array([1e-5])), jnp.linspace(0.0, 0.4, 101)
    run = jf.simulate(arm, OpenLoop(), Step((0.0,), (0.0,)), times, initial=start)
    stiffness = 0.2 / 2e-3
    decay = damping * stiffness / (2 * inertia)
    w = np.sqrt(stiffness / inertia - decay**2)
    np.testing.assert_allclose(
        run["angle_1"], 1e-5 / w * np.exp(-decay * times) * np.sin(w * times), atol=3e-9
    )


def test_stribecks_rise_has_the_forms_in_use():
    """`exp(-x^2)` without a tail, `1 / (1 + x^2)` with a whole one, in between with derivatives."""
    x, one = jnp.linspace(0.0, 4.0, 41), jnp.ones(())
    f = jax.vmap(fading, (0, None))
    np.testing.assert_allclose(f(x, 0.0 * one), np.exp(-(x**2)), rtol=1e-12)
    np.testing.assert_allclose(f(x, one), 1 / (1 + x**2), rtol=1e-12)
    slope = jax.vmap(lambda x: jax.grad(fading, 1)(x, 0.0 * one))(x)
    np.testing.assert_allclose(slope, x**4 / 2 * np.exp(-(x**2)), atol=1e-12)
    near, far = (f(x, SMALL / x[-1] ** 2 * share) for share in (0.999, 1.001))
    assert float(jnp.max(jnp.abs(near - far))) < 1e-7  # the series meets what it stands for


def test_a_bristle_takes_energy_over_a_cycle_and_loses_less_in_small_ones():
    """Work of `-T z` along `x = a sin t`: close to `4 T a` where it slides, hardly any within the bristle."""
    phases = jnp.linspace(0.0, 4 * np.pi, 40001)
    lost = []
    for size in (1e-4, 2e-3, 1.0):
        rates = size * jnp.cos(phases)

        def onward(z, rate):
            step = phases[1] * BRISTLE.settling(rate)
            towards = rate / BRISTLE.presliding / BRISTLE.settling(rate)
            z = towards + (z - towards) * jnp.exp(-step)
            return z, BRISTLE(rate, rate, rate, z) * rate

        power = np.asarray(jax.lax.scan(onward, jnp.zeros(()), rates)[1])
        lost.append(-power[20000:].sum() * float(phases[1]) / (4 * 0.2 * size))
    assert 0 < lost[0] < 0.05 < lost[1] < 0.7 < lost[2] < 1
    assert lost[2] > 0.99


def stopped(torque, presliding, method=None, damping=0.0):
    """Angle of an axis that friction stops from 0.5 rad/s, and holds."""
    effects = tuple(
        kind(size, 0.01, presliding, damping)
        for kind, size in ((CoulombFriction, torque), (AsymmetricFriction, 0.05))
    )
    arm = jf.Arm((), (jf.Joint(hub_inertia=0.1),), effects=effects)
    start = jf.InitialState(rates=jnp.array([0.5]))
    times = jnp.linspace(0.0, 0.3, 4)
    return jf.simulate(arm, OpenLoop(), Step((0.0,), (0.0,)), times, initial=start, method=method)["angle_1"]


def test_a_short_bristle_is_rigid_friction():
    rigid = stopped(0.2, None)[-1]
    far, near = (float(abs(stopped(0.2, s)[-1] - rigid)) for s in (4e-4, 1e-4))
    assert near < 0.3 * far < 0.01 * float(rigid)


def test_a_bristle_has_derivatives_in_both_modes():
    fine = jf.Fixed(1e-3)
    point = (jnp.asarray(0.2), jnp.asarray(1e-2))

    def end(torque, presliding):
        return stopped(torque, presliding, fine)[-1]

    _, along = jax.jvp(end, point, (jnp.asarray(1.0), jnp.asarray(0.1)))
    back = jax.grad(end, (0, 1))(*point)
    up, down = (end(point[0] + h, point[1] + 0.1 * h) for h in (1e-4, -1e-4))
    assert float(along) == pytest.approx(float(up - down) / 2e-4, rel=1e-4)
    assert float(back[0] + 0.1 * back[1]) == pytest.approx(float(along), rel=1e-6)


@pytest.mark.parametrize("damping", [0.0, 5e-3])
def test_implicit_steps_take_a_bristle_in(damping):
    """At steps three times as long as explicit ones could be at the start."""
    found = stopped(0.2, 1e-3, jf.Fixed(6e-3, jf.LinearlyImplicit()), damping)
    np.testing.assert_allclose(found, stopped(0.2, 1e-3, None, damping), rtol=2e-2)


def test_cable_and_bias_at_rest():
    effects = (CableStiffness(2.0, rest_angle=0.1), LoadTorqueBias(0.3))
    arm = jf.Arm((), (jf.Joint(hub_inertia=0.1, viscous_friction=2.0),), effects=effects)
    run = jf.simulate(arm, OpenLoop(), Step((0.0,), (0.0,)), jnp.linspace(0.0, 30.0, 4))
    np.testing.assert_allclose(run["angle_1"][-1], 0.1 - 0.3 / 2.0, rtol=1e-5)


def test_bad_places_are_refused():
    with pytest.raises(ValueError, match="location must be joint_1"):
        CoulombFriction(0.1, location="link_1")
    with pytest.raises(ValueError, match="joint_2"):
        jf.Arm((), (jf.Joint(hub_inertia=1.0),), effects=(CoulombFriction(0.1, location="joint_2"),))
