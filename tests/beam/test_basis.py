import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxflex import MODE_SHAPES, Joint, Link, ahmad_arm, driven_frequencies, foldager_link, locked_frequencies
from jaxflex.beam.basis import Distal
from tests.finite_element import frame_frequencies

PAYLOADS = [0.0, 0.02, 0.1]


def reference(payload, angles, locked):
    return frame_frequencies([0.5, 0.5], 0.2, 1.0, angles, [0.02, 0.02], [0.0, 1.0], (payload, 0.0), locked)


@pytest.mark.parametrize("angle", [0.0, 0.6, 1.5708, 2.5])
def test_default_basis_is_right_whatever_the_joints_do(angle):
    pose = jnp.array([0.0, angle])
    batch = jax.vmap(lambda m: ahmad_arm(m).assemble().arm.payload.mass)(jnp.array(PAYLOADS))
    np.testing.assert_allclose(batch, PAYLOADS)
    for payload in PAYLOADS:
        arm = ahmad_arm(payload)
        exact_free = reference(payload, [0.0, angle], False)[2:6]
        exact_locked = reference(payload, [0.0, angle], True)[:4]
        np.testing.assert_allclose(driven_frequencies(arm, pose)[2:6], exact_free, rtol=2e-3)
        np.testing.assert_allclose(locked_frequencies(arm, pose)[:4], exact_locked, rtol=2e-3)


def test_papers_choice_is_exact_locked_and_off_free():
    arm = ahmad_arm(0.05, mode_shapes="clamped_tip_mass")
    zero = [0.0, 0.0]
    locked = reference(0.05, zero, True)[:4]
    free = reference(0.05, zero, False)[2:6]
    np.testing.assert_allclose(locked_frequencies(arm)[:4], locked, rtol=5e-3)
    assert abs(float(driven_frequencies(arm)[5]) / free[3] - 1) > 0.15


@pytest.mark.parametrize("kind", list(MODE_SHAPES))
def test_shapes_are_tangent_orthogonal_and_scaled(kind):
    link = Link(0.6, 0.3, 2.0, modes=3, mode_shapes=kind, root_stiffness=4.0)
    distal = Distal(*(jnp.asarray(v) for v in (0.4, 0.01, 0.002, 4.0)))
    basis = link.basis(distal, True)
    zero = jnp.zeros(())
    np.testing.assert_allclose(basis.deflection(zero), 0.0, atol=1e-9)
    np.testing.assert_allclose(basis.slope(zero), 0.0, atol=1e-9)
    x, w = np.polynomial.legendre.leggauss(60)
    points, weights = 0.3 * (x + 1), 0.3 * w
    bend = jax.vmap(basis.curvature)(jnp.asarray(points))
    stiffness = 2.0 * np.einsum("p,pi,pj->ij", weights, bend, bend)
    np.testing.assert_allclose(stiffness - np.diag(np.diag(stiffness)), 0.0, atol=1e-8 * stiffness.max())
    model = link.discretise(distal, True, Joint())
    np.testing.assert_allclose(model.stiffness, np.diag(stiffness), rtol=1e-9)
    slope = jax.jacfwd(basis.deflection)(jnp.asarray(0.4))
    np.testing.assert_allclose(slope, basis.slope(jnp.asarray(0.4)), rtol=1e-9)
    assert np.all(np.asarray(model.tip_deflection) > 0)


def test_gradients_of_frequencies():
    def lowest(payload, length, rigidity):
        arm = foldager_link(payload, modes=2)
        links = tuple(
            dataclasses.replace(link, length=length, flexural_rigidity=rigidity) for link in arm.links
        )
        arm = dataclasses.replace(arm, links=links)
        return locked_frequencies(arm)[1] + driven_frequencies(arm)[1]

    point, lowest = (0.03, 0.4, 0.7), jax.jit(lowest)
    forward = jax.jit(jax.jacfwd(lowest, (0, 1, 2)))(*point)
    backward = jax.jit(jax.grad(lowest, (0, 1, 2)))(*point)
    for i in range(3):
        h = 1e-5
        up, down = list(point), list(point)
        up[i], down[i] = up[i] + h, down[i] - h
        difference = (lowest(*up) - lowest(*down)) / (2 * h)
        np.testing.assert_allclose(forward[i], difference, rtol=1e-6)
        np.testing.assert_allclose(backward[i], difference, rtol=1e-6)


def test_lumped_link_converges_to_assumed_modes():
    exact = locked_frequencies(foldager_link(0.02, modes=6))[:2]
    errors = []
    for segments in (5, 10, 20):
        lumped = locked_frequencies(foldager_link(0.02, model="lumped", segments=segments))[:2]
        errors.append(np.abs(np.asarray(lumped / exact - 1)))
    ratio = errors[0] / errors[1], errors[1] / errors[2]
    np.testing.assert_allclose(ratio, 4.0, rtol=0.25)  # second order in the length of a segment
    assert np.all(errors[-1] < 5e-3)


def test_lumped_link_with_hub_and_root_spring():
    spring = jnp.array([5.0])
    exact = driven_frequencies(foldager_link(modes=6, hub_inertia=2e-4), joint_stiffness=spring)[:3]
    lumped = driven_frequencies(
        foldager_link(model="lumped", segments=20, hub_inertia=2e-4), joint_stiffness=spring
    )[:3]
    np.testing.assert_allclose(lumped, exact, rtol=1e-2)
