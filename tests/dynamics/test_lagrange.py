import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import jaxflex as jf
from jaxflex.dynamics.lagrange import accelerations, damping_vector, unrolled_accelerations


def three_links():
    link = jf.Link(0.4, 0.3, 2.0, modes=1)
    joint = jf.Joint(hub_inertia=0.01, hub_mass=0.2, rotor_inertia=1e-3)
    return jf.Arm((link,) * 3, (joint,) * 3, jf.Payload(0.1, 1e-3), gravity=9.81)


ARMS = {
    "two links": jf.ahmad_arm,
    "single link": lambda: jf.foldager_link(0.02),
    "three links, gravity": three_links,
    "lumped": lambda: jf.foldager_link(0.02, model="lumped", segments=6),
}


@pytest.fixture(scope="module", params=list(ARMS))
def model(request):
    return ARMS[request.param]().assemble()


def state(model, seed):
    rng = np.random.default_rng(seed)
    joints = len(model.joints)
    size = model.size - joints
    q = jnp.asarray(np.concatenate([rng.uniform(-3, 3, joints), 0.02 * rng.normal(size=size)]))
    return q, jnp.asarray(rng.normal(size=model.size))


def test_mass_matrix_is_symmetric_positive_definite(model):
    for seed in range(5):
        mass = np.asarray(jf.mass_matrix(model, state(model, seed)[0]))
        np.testing.assert_allclose(mass, mass.T, rtol=1e-12, atol=1e-14)
        assert np.linalg.eigvalsh(mass).min() > 0


def test_mass_rate_minus_twice_coriolis_is_skew(model):
    q, qd = state(model, 1)
    _, rate = jax.jvp(lambda q: jf.mass_matrix(model, q), (q,), (qd,))
    skew = np.asarray(rate - 2 * jf.coriolis_matrix(model, q, qd))
    np.testing.assert_allclose(skew + skew.T, 0.0, atol=1e-11 * np.abs(skew).max() + 1e-13)


def test_scalar_accelerations_agree_with_the_matrices(model):
    q, qd = state(model, 2)
    force = jnp.asarray(np.random.default_rng(3).normal(size=model.size))
    mass, coriolis = jf.mass_matrix(model, q), jf.coriolis_matrix(model, q, qd)
    expected = jnp.linalg.solve(mass, force - coriolis @ qd - jf.gravity_vector(model, q))
    found = jnp.stack(accelerations(model, tuple(q), tuple(qd), tuple(force)))
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("by_model", [True, False])
def test_accelerations_have_the_slopes_of_the_unrolled_ones(by_model):
    model = jf.foldager_link(0.02).assemble()
    q, qd = (tuple(part) for part in state(model, 4))
    arrays, static = eqx.partition(model, eqx.is_inexact_array)

    def along(function):
        def run(arrays, q, qd, force):
            return jnp.stack(function(eqx.combine(arrays, static), q, qd, force))

        still = jax.tree.map(lambda _: None, arrays)
        moved = jax.tree.map(lambda a: 0.01 * a, arrays) if by_model else still
        return eqx.filter_jvp(run, (arrays, q, qd, q), (moved, qd, q, qd))[1]

    found, expected = along(accelerations), along(unrolled_accelerations)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_energy_does_not_depend_on_where_the_base_points(model):
    q, qd = state(model, 4)
    turned = q.at[0].add(1.234)
    energy = jf.kinetic_energy(model, tuple(q), tuple(qd))
    np.testing.assert_allclose(jf.kinetic_energy(model, tuple(turned), tuple(qd)), energy, rtol=1e-12)
    # nor on the axes in which the velocities are written: here they are those of the base
    np.testing.assert_allclose(energy, _energy_in_the_base_frame(model, q, qd), rtol=1e-6)


def _energy_in_the_base_frame(model, q, qd):
    """Kinetic energy from positions in the base frame alone, links by quadrature; assumed modes only."""
    if model.arm.links[0].model == "lumped":
        return jf.kinetic_energy(model, tuple(q), tuple(qd))
    from jaxflex.arm.kinematics import poses
    from jaxflex.beam.basis import quadrature

    arm = model.arm
    bases = [link.basis(arm.distal(i), i + 1 < len(arm.links)) for i, link in enumerate(arm.links)]

    def points(q):
        frames, tips = poses(model, tuple(q))
        _, etas = model.split(tuple(q))
        places, weights = [], []
        for i, link in enumerate(arm.links):
            x, w = quadrature(link.length)
            bend = jax.vmap(bases[i].deflection)(x) @ jnp.stack(etas[i])
            c, s = jnp.cos(frames[i].heading), jnp.sin(frames[i].heading)
            places += [frames[i].x + c * x - s * bend, frames[i].y + s * x + c * bend]
            weights += [link.mass_per_length * w] * 2
            if i > 0:
                places += [jnp.stack([frames[i].x, frames[i].y])]
                weights += [jnp.full(2, arm.joints[i].hub_mass)]
            places += [frames[i].heading[None]]
            weights += [arm.joints[i].hub_inertia[None]]
        places += [jnp.stack([tips[-1].x, tips[-1].y, tips[-1].heading])]
        weights += [jnp.stack([arm.payload.mass, arm.payload.mass, arm.payload.inertia])]
        return jnp.concatenate(places), jnp.concatenate(weights)

    _, speed = jax.jvp(lambda q: points(q)[0], (q,), (qd,))
    rotors = sum(j.reflected_inertia * qd[i] ** 2 for i, j in enumerate(arm.joints))
    return 0.5 * (jnp.sum(points(q)[1] * speed**2) + rotors)


@settings(max_examples=25, deadline=None)
@given(
    payload=st.floats(0.0, 0.5),
    inertia=st.floats(0.0, 1e-2),
    length=st.floats(0.1, 1.5),
    rigidity=st.floats(0.05, 50.0),
    hub=st.floats(1e-5, 0.1),
    angle=st.floats(-3.1, 3.1),
)
def test_mass_matrix_over_the_parameter_space(payload, inertia, length, rigidity, hub, angle):
    mass = np.asarray(_mass(payload, inertia, length, rigidity, hub, angle))
    assert np.all(np.isfinite(mass))
    scale = np.sqrt(np.diag(mass))
    assert np.linalg.eigvalsh(mass / np.outer(scale, scale)).min() > 0


@jax.jit
def _mass(payload, inertia, length, rigidity, hub, angle):
    link = jf.Link(length, 0.2, rigidity)
    arm = jf.Arm((link, link), (jf.Joint(hub), jf.Joint(hub, 0.5)), jf.Payload(payload, inertia))
    model = arm.assemble()
    q = jnp.zeros(model.size).at[1].set(angle).at[3].set(0.05 * length)
    return jf.mass_matrix(model, q)


def rigid_two_link(q2, w1, w2, m, l, hub, hub_mass, payload):
    """Textbook rigid two-link arm of uniform links: mass matrix and velocity forces."""
    inertia = m * l * l / 3
    carried = m + hub_mass + payload
    couple = l * l * (m / 2 + payload)
    a22 = inertia + hub + payload * l * l
    a12 = a22 + couple * np.cos(q2)
    a11 = inertia + hub + carried * l * l + a22 + 2 * couple * np.cos(q2)
    h = couple * np.sin(q2)
    return np.array([[a11, a12], [a12, a22]]), np.array([-h * w2 * (2 * w1 + w2), h * w1 * w1])


def test_stiff_links_move_as_rigid_ones():
    m, l, hub, hub_mass, payload = 0.1, 0.5, 0.02, 1.0, 0.07
    mass, force = rigid_two_link(0.7, 1.3, -0.4, m, l, hub, hub_mass, payload)
    expected = np.linalg.solve(mass, np.array([0.3, -0.1]) - force)
    joints = (jf.Joint(hub), jf.Joint(hub, hub_mass))
    rigid = jf.Arm((jf.Link(l, m / l, 1.0, modes=0),) * 2, joints, jf.Payload(payload)).assemble()
    as_scalars = [tuple(map(jnp.asarray, v)) for v in ((0.2, 0.7), (1.3, -0.4), (0.3, -0.1))]
    np.testing.assert_allclose(accelerations(rigid, *as_scalars), expected, rtol=1e-12)
    # the quasi-static response of a stiff link is that of the rigid one: frequencies go up, hub modes stay
    free = [jf.driven_frequencies(jf.Arm((jf.Link(l, m / l, ei),) * 2, joints))[2] for ei in (1.0, 100.0)]
    np.testing.assert_allclose(free[1] / free[0], 10.0, rtol=1e-6)


def test_single_link_reduces_to_the_textbook_coupled_model():
    # hub and one clamped-free mode: [[J, B], [B, C]], J = J_h + rho l^3 / 3 (Bellezza et al. 1990)
    arm = jf.Arm((jf.Link(0.8, 0.5, 3.0, modes=1, mode_shapes="clamped_free"),), (jf.Joint(0.02),))
    model = arm.assemble()
    mass = np.asarray(jf.mass_matrix(model, jnp.zeros(2)))
    z = 1.875104068711961
    x, w = np.polynomial.legendre.leggauss(60)
    x, w = 0.4 * (x + 1), 0.4 * w
    g = (np.cos(z) + np.cosh(z)) / (np.sin(z) + np.sinh(z))
    phi = np.cosh(z * x / 0.8) - np.cos(z * x / 0.8) - g * (np.sinh(z * x / 0.8) - np.sin(z * x / 0.8))
    ratio = np.sum(0.5 * w * x * phi) / np.sqrt(np.sum(0.5 * w * phi**2))
    np.testing.assert_allclose(mass[0, 0], 0.02 + 0.5 * 0.8**3 / 3, rtol=1e-12)
    np.testing.assert_allclose(mass[0, 1] / np.sqrt(mass[1, 1]), ratio, rtol=1e-9)


def test_damping_rules():
    model = jf.ahmad_arm(damping="ahmad").assemble()
    expected = 0.1 * np.sqrt(np.asarray(model.links[0].stiffness))
    np.testing.assert_allclose(model.links[0].damping, expected, rtol=1e-12)
    assert damping_vector(model).shape == (model.size,)


def test_large_arm_uses_the_library_factorisation():
    model = jf.foldager_link(0.02, model="lumped", segments=12).assemble()
    q, qd = state(model, 5)
    force = jnp.ones(model.size)
    expected = jnp.linalg.solve(
        jf.mass_matrix(model, q),
        force - jf.coriolis_matrix(model, q, qd) @ qd - jf.gravity_vector(model, q),
    )
    found = jnp.stack(accelerations(model, tuple(q), tuple(qd), tuple(force)))
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())
