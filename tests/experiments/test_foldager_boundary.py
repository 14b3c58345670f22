import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from experiments.foldager import DRIVEN_LUMPED, HUB_INERTIA, YOUNGS_MODULUS, inferred_link
from experiments.foldager_boundary.chain import far_end_chain
from experiments.foldager_boundary.inference import Boundary, CoupledLink
from experiments.foldager_boundary.run import run

from ..finite_element import frame_frequencies


@pytest.fixture(scope="module")
def figures(tmp_path_factory):
    folder = tmp_path_factory.mktemp("boundary")
    found = run(folder, reduced=True)
    assert {p.name for p in folder.iterdir()} == {"boundary.png", "plane.png", "masses.png"}
    return found


def test_coupled_model_meets_both_measured_frequencies(figures):
    for found in figures["inferred"].values():
        assert np.abs(found["driven_error_pct"]).max() < 7.0
        assert found["root_stiffness_N_m"] >= 0.0
    assert np.abs(figures["inferred"]["all five"]["driven_error_pct"]).max() < 2.0
    assert abs(figures["paper_lumped_error_pct"][1]) > 30.0


def test_constants_of_the_other_experiments_are_those_inferred_here(figures):
    best = figures["inferred"]["all five"]
    np.testing.assert_allclose(1e9 * best["youngs_modulus_GPa"], YOUNGS_MODULUS, rtol=1e-3)
    np.testing.assert_allclose(best["hub_inertia_kg_m2"], HUB_INERTIA, rtol=1e-3)
    low, high = figures["open_to_doubt"]["reading"]["hub_inertia_kg_m2"]
    assert low < HUB_INERTIA < high


def test_exact_inversion_reads_as_measured(figures):
    for found in figures["inferred"].values():
        inertia, stiffness = found["exact_hub_inertia_kg_m2"][0], found["exact_root_stiffness_N_m"][0]
        back = CoupledLink(6).driven(Boundary(1e9 * found["youngs_modulus_GPa"], inertia, stiffness))
        np.testing.assert_allclose(back[:2], [28.0, 75.0], rtol=1e-8)


def test_model_is_the_librarys_and_the_finite_element_limit():
    arm = inferred_link(modes=6)
    spring = 3.0
    ours = CoupledLink(6).frequencies(Boundary(YOUNGS_MODULUS, HUB_INERTIA, spring))
    np.testing.assert_allclose(
        ours, jf.driven_frequencies(arm, joint_stiffness=jnp.array([spring])), rtol=1e-10
    )
    link = arm.links[0]
    limit = frame_frequencies(
        [float(link.length)], float(link.mass_per_length), float(link.flexural_rigidity),
        [0.0], [HUB_INERTIA], [0.0], (0.0, 0.0), False,
    )  # fmt: skip
    free = CoupledLink(6).driven(Boundary(YOUNGS_MODULUS, HUB_INERTIA, 0.0))
    np.testing.assert_allclose(free[:2], limit[1:3], rtol=5e-4)


def test_hub_runs_from_pinned_to_clamped():
    link = CoupledLink(6)
    # tan z = tanh z, and cos z cosh z = -1: the ends of the curve in closed form
    pinned, clamped = np.array([3.926602312048, 7.068582745629]), np.array([1.875104068712, 4.694091132974])
    beam = jf.foldager_link().links[0]
    unit = np.sqrt(float(beam.flexural_rigidity / (beam.mass_per_length * beam.length**4))) / (2 * np.pi)
    np.testing.assert_allclose(link.driven(Boundary(78e9, 0.0, 0.0))[:2], pinned**2 * unit, rtol=1e-3)
    np.testing.assert_allclose(link.driven(Boundary(78e9, 1e4, 0.0))[:2], clamped**2 * unit, rtol=1e-5)
    stiff = link.frequencies(Boundary(78e9, 0.0, 1e7))[:2]
    np.testing.assert_allclose(stiff, clamped**2 * unit, rtol=1e-4)


def test_damper_between_free_and_clamped():
    link = CoupledLink(6)
    free = Boundary(jnp.asarray(63e9), jnp.asarray(5e-5), jnp.asarray(0.0))

    def lowest(damping):
        poles = np.asarray(link.poles(free, jnp.asarray(damping)))
        return np.sort(poles.imag[poles.imag > 20.0])[:2] / (2 * np.pi)

    np.testing.assert_allclose(lowest(0.0), link.driven(free)[:2], rtol=1e-8)
    np.testing.assert_allclose(lowest(1e3), link.clamped(jnp.asarray(63e9))[:2], rtol=1e-4)


def test_far_end_chain(figures):
    theory = jf.foldager_link().links[0]
    # two masses, one spring between them: closed form with a free hinge
    h, m = float(theory.length) / 2, float(theory.mass) / 2
    square = float(theory.flexural_rigidity) / h / (m * h**2) * (1 + 4) / 1
    np.testing.assert_allclose(far_end_chain(theory, 2)[0], np.sqrt(square) / (2 * np.pi), rtol=1e-6)
    many = far_end_chain(theory, 200)[:3]
    np.testing.assert_allclose(many, CoupledLink(8).driven(Boundary(78e9, 0.0, 0.0))[:3], rtol=0.02)
    closest = figures["lumped"]
    assert closest["closest_number_of_masses"] == 10
    np.testing.assert_allclose(closest["closest_hz"], DRIVEN_LUMPED, rtol=0.03)
