"""Traced programs are found again by another process, and only where they are the same."""

import os
import subprocess
import sys
from pathlib import Path

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import optimistix as optx
import pytest

import jaxflex as jf
from jaxflex.kept import Unkept, named_for_good

ROOT = Path(__file__).resolve().parents[1]
LINK = """
import sys
from concurrent.futures import ThreadPoolExecutor
import jax, jax.numpy as jnp
import jaxflex as jf, controllers as ctl
jf.set_up(cache=sys.argv[1])
import jaxflex.dynamics.lagrange as lagrange
energy, traced = lagrange.kinetic_energy, []
lagrange.kinetic_energy = lambda *args: traced.append(1) or energy(*args)
arm = jf.foldager_link()
def tip(mass):
    run = jf.simulate(arm.with_payload(mass), {law}, ctl.Move((0.0,), (0.5,), 0.5), jnp.linspace(0.0, 1.0, 11),
                      method=jf.Fixed(1e-3), channels=["tip_x"])
    return run["tip_x"][-1]
with ThreadPoolExecutor(2) as pool:
    first, second = (float(end) for end in pool.map(tip, (0.05, 0.05)))
assert first == second
print(len(traced), first, {more})
"""
PD = "ctl.PD((2.0,), (0.5,))"


def run(cache: Path, law: str = PD, own: str = "", more: str = "0"):
    """How often the energy was traced for a simulation in two threads, where it ended, and `more`."""
    code = LINK.replace("{law}", law).replace("{more}", more).replace("arm = jf", f"{own}\narm = jf")
    found = subprocess.run(
        [sys.executable, "-c", code, str(cache)],
        capture_output=True, text=True, check=True,
        env={"PATH": os.environ["PATH"], "PYTHONPATH": str(ROOT), "HOME": str(cache)},
    )  # fmt: skip
    traced, end, rest = map(float, found.stdout.split())
    return traced, end, rest


def test_a_second_process_traces_nothing_and_gets_the_same(tmp_path):
    traced, first, _ = run(tmp_path)
    assert traced > 0
    files = list((tmp_path / "traced").iterdir())
    assert files
    again, second, slope = run(tmp_path, more="float(jax.grad(tip)(0.05))")
    assert again == 0 and second == first
    assert np.isfinite(slope) and slope != 0  # transformed, it is traced as ever
    assert sorted((tmp_path / "traced").iterdir()) == sorted(files)
    for file in files:
        file.write_bytes(file.read_bytes()[:100])
    mended, third, _ = run(tmp_path)
    assert mended > 0 and third == first


def test_what_is_ones_own_may_change_under_its_name(tmp_path):
    own = "class Own(ctl.PD):\n    def command(self, *args):\n"
    own += "        return tuple({gain} * u for u in super().command(*args))\n"
    ends = [run(tmp_path, "Own((2.0,), (0.5,))", own.replace("{gain}", gain))[1] for gain in ("1.0", "0.2")]
    assert ends[0] != ends[1]


def test_names_tell_constants_apart():
    things = [
        (1,), (True,), (1.0,), ("1",), [1], {"a": 1}, {"a": 2}, {"b": 1}, (1, 2), ((1,), 2), (None,),
        jf.simulate, jf.Fixed, jnp.dtype("float32"), jnp.dtype("float64"),
        optx.BFGS(1e-4, 1e-4), optx.BFGS(1e-4, 1e-3), frozenset({1, 2}), frozenset({1, 3}),
    ]  # fmt: skip
    names = [named_for_good(thing) for thing in things]
    assert len(set(names)) == len(names)
    assert named_for_good(optx.BFGS(1e-4, 1e-4)) == names[things.index((1, 2)) + 7]


def test_what_has_no_lasting_name_is_not_kept():
    class Own(eqx.Module):
        gain: float = 1.0

    for thing in (lambda x: x, Own(), Own, object(), test_names_tell_constants_apart):
        with pytest.raises(Unkept):
            named_for_good((thing,))


def test_a_cache_that_cannot_be_written_is_no_reason_to_fail(tmp_path):
    (tmp_path / "traced").write_text("a file where the folder should be")
    traced, end, _ = run(tmp_path)
    assert traced > 0 and np.isfinite(end)
