import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from jaxflex import scalar
from jaxflex.beam.boundary import Ends, frequency_equation, wave_numbers
from jaxflex.beam.mode_shapes import solve_mode_shapes

ZERO = scalar(0.0)


def clamped(mass=0.0, inertia=0.0):
    return Ends(None, None, scalar(mass), scalar(inertia))


def hinged(stiffness=0.0, hub=0.0, mass=0.0, inertia=0.0):
    return Ends(scalar(stiffness), scalar(hub), scalar(mass), scalar(inertia))


def test_clamped_free_roots():
    # cosh z cos z = -1 (Foldager et al., below (8)), to twelve figures
    expected = [1.875104068712, 4.694091132974, 7.854757438238, 10.995540734875, 14.137168391046]
    np.testing.assert_allclose(wave_numbers(clamped(), 5), expected, rtol=1e-11)


def test_pinned_free_roots():
    roots = np.asarray(wave_numbers(hinged(), 6))
    np.testing.assert_allclose(np.tan(roots), np.tanh(roots), rtol=1e-9)
    np.testing.assert_allclose(roots[:2], [3.926602312048, 7.068582745629], rtol=1e-11)


@pytest.mark.parametrize(
    "ends, limit",
    [
        (clamped(mass=1e9), [None, 3.926602312, 7.068582746]),  # clamped-pinned
        (clamped(mass=1e7, inertia=1e7), [None, None, 4.730040745]),  # clamped-clamped
        (hinged(stiffness=1e12), [1.875104069, 4.694091133]),  # clamped-free
        (hinged(hub=1e9), [1.875104069, 4.694091133]),
    ],
)
def test_limits(ends, limit):
    roots = wave_numbers(ends, len(limit) if limit[0] is not None or limit[1] is not None else 3)
    if limit[:2] == [None, None]:
        roots = [None, None, wave_numbers(ends, 1)[0]]  # the two rigid modes lie below the grid
    for root, expected in zip(roots, limit, strict=True):
        if expected is not None:
            np.testing.assert_allclose(root, expected, rtol=2e-6)


@settings(max_examples=30, deadline=None)
@given(st.floats(0.0, 20.0), st.floats(0.0, 5.0))
def test_roots_solve_the_equation_of_ahmad(mass, inertia):
    # Ahmad et al. (23) with the argument beta l written out, all divided by cosh z
    z = np.asarray(wave_numbers(clamped(mass, inertia), 4))
    c, s, t = np.cos(z), np.sin(z), np.tanh(z)
    value = (
        1 / np.cosh(z) + c
        - mass * z * (s - c * t)
        - inertia * z**3 * (s + c * t)
        + mass * inertia * z**4 * (1 / np.cosh(z) - c)
    )  # fmt: skip
    scale = (1 + mass * z) * (1 + inertia * z**3)
    np.testing.assert_allclose(value / scale, 0.0, atol=1e-12)
    assert np.all(np.diff(z) > 0)


@pytest.mark.parametrize("argument", ["mass", "inertia", "stiffness", "hub"])
def test_gradients_against_finite_differences(argument):
    base = dict(mass=0.7, inertia=0.05)
    make = clamped
    if argument in ("stiffness", "hub"):
        base, make = dict(stiffness=3.0, hub=0.4, mass=0.2), hinged

    def roots(x):
        return wave_numbers(make(**{**base, argument: x}), 3)

    x, h = base[argument], 1e-5
    difference = (roots(x + h) - roots(x - h)) / (2 * h)
    np.testing.assert_allclose(jax.jacfwd(roots)(x), difference, rtol=1e-6)
    np.testing.assert_allclose(jax.jacrev(roots)(x), difference, rtol=1e-6)


def test_gradient_at_zero_payload():
    slope = jax.grad(lambda m: wave_numbers(clamped(m), 1)[0])(0.0)
    # Rayleigh: d(omega^2)/omega^2 = -phi(l)^2 dM / (modal mass) = -4 dM, omega ~ z^2
    np.testing.assert_allclose(slope, -1.875104068712, rtol=1e-6)


@pytest.mark.parametrize("ends", [clamped(0.7, 0.1), hinged(3.0, 0.2, 0.5, 0.1), hinged(), clamped()])
def test_mode_shapes_meet_their_ends(ends):
    length = scalar(0.7)
    shapes = solve_mode_shapes(length, ends, 6)
    z = np.asarray(shapes.wave_numbers)
    root, tip = scalar(0.0), length
    np.testing.assert_allclose(shapes.deflection(root), 0.0, atol=1e-9)
    third = jax.jacfwd(shapes.curvature)(tip)
    slope = 0.7 * np.asarray(shapes.slope(tip))
    np.testing.assert_allclose(
        0.7**2 * np.asarray(shapes.curvature(tip)) / z**2, z**2 * ends.tip_inertia * slope, atol=1e-6
    )
    np.testing.assert_allclose(
        0.7**3 * np.asarray(third) / z**3, -z * ends.tip_mass * np.asarray(shapes.deflection(tip)), atol=1e-6
    )
    curvature_0, slope_0 = 0.7**2 * np.asarray(shapes.curvature(root)), 0.7 * np.asarray(shapes.slope(root))
    if ends.root_stiffness is None:
        np.testing.assert_allclose(slope_0 / z, 0.0, atol=1e-9)
    else:
        spring = float(ends.root_stiffness) - z**4 * float(ends.hub_inertia)
        np.testing.assert_allclose(
            curvature_0 / z**2, spring * slope_0 / z**2, atol=1e-6 * np.max(np.abs(spring)) + 1e-8
        )


def test_works_under_vmap_and_jit():
    masses = jnp.linspace(0.0, 1.0, 5)
    batch = jax.jit(jax.vmap(lambda m: wave_numbers(clamped(m), 2)))(masses)
    single = jnp.stack([wave_numbers(clamped(m), 2) for m in masses])
    np.testing.assert_allclose(batch, single, rtol=1e-12)
    assert frequency_equation(batch[0, 0], clamped()).shape == ()
