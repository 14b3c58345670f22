"""The arm and the measurements of Foldager et al. (2014), as the experiments on them share them."""

import equinox as eqx

import jaxflex as jf

# Table 1 [Hz]
CLAMPED_THEORY = (7.8, 49.0, 140.0)
CLAMPED_MEASURED = (7.2, 45.0, 119.0)
PINNED_THEORY = (34.0, 110.0, 230.0)
DRIVEN_MEASURED = (28.0, 75.0)
DRIVEN_LUMPED = (30.0, 98.0, 200.0)

YOUNGS_MODULUS_OF_THEORY = 78e9  # Pa; gives the clamped frequencies of the paper's theory

# What foldager_boundary infers from the five measured frequencies; its test holds them to it
YOUNGS_MODULUS = 63.4e9  # Pa
HUB_INERTIA = 4.72e-5  # kg m^2


def theoretical_link(hub_inertia: jf.ScalarLike = 0.0, **options) -> jf.Arm:
    """The link of the paper's theory with `hub_inertia` [kg m^2]; `options` as for `foldager_link`."""
    return jf.foldager_link(hub_inertia=hub_inertia, **options)


def with_youngs_modulus(arm: jf.Arm, youngs_modulus: jf.ScalarLike) -> jf.Arm:
    """The arm of `foldager_link` with another Young's modulus [Pa]."""
    ratio = jf.scalar(youngs_modulus) / YOUNGS_MODULUS_OF_THEORY
    return eqx.tree_at(
        lambda a: a.links[0].flexural_rigidity, arm, replace_fn=lambda rigidity: rigidity * ratio
    )


def inferred_link(**options) -> jf.Arm:
    """The link with the Young's modulus and hub inertia that Table 1 implies."""
    return with_youngs_modulus(jf.foldager_link(hub_inertia=HUB_INERTIA, **options), YOUNGS_MODULUS)
