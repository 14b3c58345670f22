"""Models in files: numbers come back exactly, another structure is refused by name."""

import equinox as eqx
import jax
import jax.numpy as jnp
import pytest

import controllers as ctl
import jaxflex as jf
from jaxflex.effects import CoulombFriction

ARM = jf.ahmad_arm(0.03)
MODELS = {
    "arm": (ARM, jf.ahmad_arm(0.1)),
    "ahmad damping": (jf.ahmad_arm(damping="ahmad"), jf.ahmad_arm(0.0, damping="ahmad")),
    "effect": (CoulombFriction(0.2), CoulombFriction(0.0)),
    "shaped": (
        ctl.Shaped(ctl.Step((0.0,), (1.0,)), ctl.zvd(4.0)),
        ctl.Shaped(ctl.Step((1.0,), (2.0,)), ctl.zvd(1.0)),
    ),
    "network": tuple(eqx.nn.MLP(2, 1, 4, 1, key=jax.random.key(i)) for i in (0, 1)),
    "dictionary": ({"a": jnp.arange(3), "b": 2.0}, {"a": jnp.zeros(3, int), "b": 0.0}),
}


@pytest.mark.parametrize("model, like", MODELS.values(), ids=MODELS)
def test_numbers_come_back(model, like, tmp_path):
    jf.save_model(tmp_path / "m.eqx", model)
    again = jf.load_model(tmp_path / "m.eqx", like)
    assert eqx.tree_equal(again, model) and not eqx.tree_equal(like, model)


@pytest.mark.parametrize(
    "like, message",
    [
        (jf.ahmad_arm(modes=3), "what is fixed in the model differs"),
        (jf.ahmad_arm(damping="ahmad"), r"links\[0\].damping_ratio"),
        (jf.foldager_link(), r"the file holds nothing"),
        (
            eqx.tree_at(lambda a: a.payload.mass, ARM, jnp.zeros(3)),
            r"payload.mass: the file holds float64\[\], .* float64\[3\]",
        ),
        (eqx.tree_at(lambda a: a.payload.mass, ARM, jnp.zeros((), jnp.float32)), "float32"),
    ],
)
def test_another_structure_is_refused(like, message, tmp_path):
    jf.save_model(tmp_path / "arm.eqx", ARM)
    with pytest.raises(jf.ModelFileError, match=message):
        jf.load_model(tmp_path / "arm.eqx", like)


def test_files_that_are_none(tmp_path):
    (tmp_path / "text").write_text("{}\n")
    with pytest.raises(jf.ModelFileError, match="not a model file"):
        jf.load_model(tmp_path / "text", ARM)
    with pytest.raises(jf.ModelFileError, match="cannot be read"):
        jf.load_model(tmp_path / "absent", ARM)
    jf.save_model(tmp_path / "whole", ARM)
    (tmp_path / "cut").write_bytes((tmp_path / "whole").read_bytes()[:-50])
    with pytest.raises(jf.ModelFileError, match="cannot be read"):
        jf.load_model(tmp_path / "cut", ARM)
