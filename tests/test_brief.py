import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import controllers as ctl
import jaxflex as jf
from jaxflex.effects import CoulombFriction

ARM = jf.ahmad_arm()
MOVE = ctl.Move((0.0, 0.0), (0.8, 0.5), 2.0)
PARTS = {
    "arm": ARM,
    "lumped": jf.foldager_link(model="lumped"),
    "batch of arms": eqx.filter_vmap(ARM.with_payload)(jnp.linspace(0.0, 0.1, 50)),
    "six joints": jf.Arm((), (jf.Joint(hub_inertia=1.0),) * 20),
    "assembled": ARM.assemble(),
    "reference": ctl.Shaped(MOVE, ctl.zvd(4.0)),
    "shaper": ctl.zvd(4.0),
    "design": ctl.Design(ctl.PD((3.0, 0.4), (9.0, 0.8)), MOVE, ctl.zvd(4.0)),
    "gains": ctl.PD((3.0, 0.4), (9.0, 0.8)),
    "recording": jf.Recording(np.linspace(0, 1, 10_000), {"angle_1": np.zeros(10_000)}, source="run.csv"),
    "linear": jf.linearise(jf.foldager_link(modes=1), jnp.zeros(1), channels=("angle_1",)),
    "arm file": jf.ArmFile(ARM, {"default": 0.1}, None),
}


@pytest.mark.parametrize("part", PARTS.values(), ids=PARTS)
def test_fits_a_screen(part):
    lines = repr(part).splitlines()
    assert len(lines) <= 50 and max(map(len, lines)) <= 150


def test_is_the_call_that_makes_it():
    names = {name: getattr(jf, name) for name in dir(jf)} | {"CoulombFriction": CoulombFriction}
    for part in (
        ARM,
        jf.foldager_link(model="lumped"),
        jf.Joint(),
        CoulombFriction(0.2),
        jf.Sensor(bias=0.1),
    ):
        again = eval(repr(part), names)
        assert eqx.tree_equal(again, part, rtol=1e-5, atol=1e-12), repr(part)
    assert repr(jf.Joint()) == "Joint()"
    assert repr(jf.Payload(mass=0.05)) == "Payload(mass=0.05)"
    assert "gravity" not in repr(ARM) and "gravity=9.81" in repr(jf.Arm((), (jf.Joint(1.0),), gravity=9.81))


def test_batches_tracers_and_shapes_are_said():
    batch = jax.vmap(lambda m: jf.Payload(mass=m))(jnp.linspace(0.0, 0.1, 50))
    assert "float64[50] from 0 to 0.1" in repr(batch)
    said = []
    jax.jit(lambda m: said.append(repr(jf.Payload(mass=m, inertia=m))) or m)(0.1)
    assert said == ["Payload(mass=traced float64[], inertia=traced float64[])"]
    assert "mass=float64[]" in repr(jax.eval_shape(lambda m: jf.Payload(mass=m), 0.1))


def test_a_part_of_another_library_is_cut_short():
    class Learnt(jf.AbstractController):
        network: eqx.nn.MLP

        def initial(self):
            return None

        def command(self, t, memory, measurement, setpoint):
            return (t,)

        def rate(self, t, memory, measurement, setpoint):
            return None

    network = eqx.nn.MLP(2, 1, 8, 2, key=jax.random.key(0))
    assert repr(Learnt(network)) == "Learnt(network=MLP(…))"
