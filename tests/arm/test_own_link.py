"""A link of another class than the library's is taken wherever links are."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from controllers import OpenLoop, Step


class Half(jf.AbstractLink):
    """Half the length of `whole`, which knows how to make its constants."""

    whole: jf.Link
    thickness: None = None
    modes: int = eqx.field(static=True, default=2)

    @property
    def part(self):
        return eqx.tree_at(lambda link: link.length, self.whole, self.length)

    @property
    def length(self):
        return self.whole.length / 2

    @property
    def mass(self):
        return self.part.mass

    def discretise(self, distal, carries_link, joint):
        return self.part.discretise(distal, carries_link, joint)


LINK = jf.Link(0.8, 0.15, 0.7, damping_ratio=0.01)
OWN = jf.Arm((Half(LINK),), (jf.Joint(hub_inertia=1e-3),), jf.Payload(0.02))
SAME = dataclasses.replace(OWN, links=(dataclasses.replace(LINK, length=jf.scalar(0.4)),))


def test_it_moves_and_rings_as_the_same_link_of_the_library():
    for frequencies in (jf.driven_frequencies, jf.locked_frequencies):
        np.testing.assert_allclose(frequencies(OWN), frequencies(SAME), rtol=1e-12)
    np.testing.assert_allclose(jf.clamped_frequencies(OWN, 0), jf.clamped_frequencies(SAME, 0), rtol=1e-3)
    times = jnp.linspace(0.0, 0.3, 31)

    def final(arm):
        run = jf.simulate(
            arm, OpenLoop(), Step((0.0,), (0.02,), 0.05), times, channels=("tip_y",), method=jf.Fixed()
        )
        return run["tip_y"][-1]

    @jax.jit
    def longer(arm, share):
        return final(eqx.tree_at(lambda a: a.links[0].whole.length, arm, LINK.length * share))

    assert final(OWN) == pytest.approx(float(final(SAME)), rel=1e-9)
    slope = jax.jacfwd(lambda share: longer(OWN, share))(1.0)  # through assembly and simulation
    step = 1e-4
    assert slope == pytest.approx(float(longer(OWN, 1 + step) - longer(OWN, 1 - step)) / (2 * step), rel=1e-2)


def test_what_cannot_be_is_refused(tmp_path):
    with pytest.raises(ValueError, match="save_model"):
        jf.save_arm(OWN, tmp_path / "arm.toml")
    with pytest.raises(ValueError, match="AbstractLink, not Joint"):
        jf.Arm((jf.Joint(),), (jf.Joint(),))
    assert "Half" in repr(OWN)
