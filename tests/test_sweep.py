import subprocess
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxflex as jf
from controllers import PD, Move

pytestmark = pytest.mark.optimised

ROOT = Path(__file__).resolve().parents[1]


def motion(mass):
    arm = jf.ahmad_arm(mass, modes=1, drive="torque")
    run = jf.simulate(
        arm, PD((6.0, 2.0), (2.0, 0.6)), Move((0.0, 0.0), (0.3, 0.2), 0.1), jnp.linspace(0.0, 0.1, 3),
        method=jf.Fixed(2e-3), channels=["tip_y"],
    )  # fmt: skip
    return {"tip": run["tip_y"], "failed": run.status}


def test_a_sweep_is_vmap():
    masses = np.linspace(0.0, 0.1, 11)
    found = jf.sweep(motion, masses, chunk=8, lanes=4)
    expected = jax.vmap(motion)(jnp.asarray(masses))
    np.testing.assert_allclose(found["tip"], expected["tip"], rtol=1e-12, atol=1e-15)
    assert found["failed"].shape == (11,)


def test_one_more_member_compiles_nothing():
    traced = []

    def double(x):
        traced.append(x.shape)
        return 2 * x

    for count in (65, 66, 67, 128):
        np.testing.assert_array_equal(jf.sweep(double, np.arange(count)), 2 * np.arange(count))
    assert len(traced) == 1


def test_memory_is_that_of_a_chunk():
    # the squares of a million numbers each: all at once would be 80 GB
    def heavy(x):
        return jnp.sum((x + jnp.arange(1_000_000.0)) ** 2)

    found = jf.sweep(heavy, np.zeros(10_000), chunk=16, lanes=4)
    assert found.shape == (10_000,) and np.ptp(found) == 0


def test_a_sweep_goes_on_where_it_was_stopped(tmp_path):
    members = np.arange(20.0)

    def stop(done, count):
        assert count == 20
        if done == 12:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        jf.sweep(jnp.sin, members, chunk=4, lanes=4, folder=tmp_path, progress=stop)
    asked = []

    def watched(x):
        jax.debug.callback(lambda v: asked.append(float(v)), x, ordered=False)
        return jnp.sin(x)

    found = jf.sweep(watched, members, chunk=4, lanes=4, folder=tmp_path)
    jax.effects_barrier()
    np.testing.assert_allclose(found, np.sin(members), rtol=1e-15)
    assert sorted(asked) == list(range(12, 20))
    again = jf.sweep(
        lambda x: pytest.fail() if False else jnp.sin(x), members, chunk=4, lanes=4, folder=tmp_path
    )
    np.testing.assert_array_equal(again, found)
    other = jf.sweep(jnp.sin, members + 1, chunk=4, lanes=4, folder=tmp_path)
    np.testing.assert_allclose(other, np.sin(members + 1), rtol=1e-15)


@pytest.mark.parametrize("members", [np.zeros(0), {"a": np.zeros(3), "b": np.zeros(4)}, 1.0])
def test_members_that_do_not_fit_are_refused(members):
    with pytest.raises(ValueError, match="first axes"):
        jf.sweep(lambda m: m, members)


MEMBERS = """
import sys, numpy as np, jax
import jaxflex as jf
{setup}
x = np.linspace(0.0, 1.0, 103)
found = jf.sweep(lambda v: jax.numpy.stack([v * v, -v]), x, chunk=32, lanes=4{options})
np.testing.assert_allclose(found, np.stack([x * x, -x], 1))
print("devices", jax.device_count(), jax.process_count())
"""


def script(setup, options=""):
    code = MEMBERS.format(setup=setup, options=options)
    return subprocess.Popen(
        [sys.executable, "-c", code],
        env={"PATH": "", "PYTHONPATH": f"{ROOT}:{':'.join(sys.path)}", "HOME": "/nonexistent"},
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip


def test_several_devices_of_one_process():
    out, _ = script("jf.set_up(cache=None, devices=3)").communicate(timeout=120)
    assert "devices 3 1" in out, out


def test_two_processes(tmp_path):
    setup = """
jf.set_up(cache=None, devices=2)
jax.distributed.initialize("localhost:{port}", 2, {index})
"""
    port = 20_000 + hash(str(tmp_path)) % 20_000
    options = f", folder={str(tmp_path)!r}"
    both = [script(setup.format(port=port, index=i), options) for i in range(2)]
    for process in both:
        out, _ = process.communicate(timeout=120)
        assert "devices 4 2" in out, out
