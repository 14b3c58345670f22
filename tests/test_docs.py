"""The documentation says what there is: every public name has words, every equation its function."""

import importlib
import inspect
import re
from pathlib import Path

import pytest

import controllers
import jaxflex

ROOT = Path(__file__).resolve().parents[1]
PHYSICS = (ROOT / "docs" / "physics.md").read_text()


def public(package):
    for name, thing in vars(package).items():
        if not name.startswith("_") and (inspect.isclass(thing) or callable(thing)):
            yield f"{package.__name__}.{name}", thing


NAMES = dict([*public(jaxflex), *public(controllers)])
NAMES = {name: thing for name, thing in NAMES.items() if hasattr(thing, "__qualname__")}


@pytest.mark.parametrize("name", NAMES)
def test_public_names_and_their_methods_are_documented(name):
    thing = NAMES[name]
    assert inspect.getdoc(thing), name
    if inspect.isclass(thing) and thing.__module__.split(".")[0] in ("jaxflex", "controllers"):
        generated = f"{thing.__name__}("  # what dataclasses write where nothing was written
        assert not (thing.__doc__ or "").startswith(generated), name
        for part, member in vars(thing).items():
            if not part.startswith("_") and (inspect.isfunction(member) or isinstance(member, property)):
                assert inspect.getdoc(getattr(thing, part)), f"{name}.{part}"


@pytest.mark.parametrize("paper, last", [("Ahmad", 27), ("Foldager", 12)])
def test_every_equation_is_mapped_in_order(paper, last):
    section = next(part for part in PHYSICS.split("\n## ") if part.startswith(paper))
    assert [int(n) for n in re.findall(r"^\| \((\d+)\)", section, re.M)] == list(range(1, last + 1))


@pytest.mark.parametrize("path", sorted(set(re.findall(r"`((?:jaxflex|controllers)\.[\w.]+)`", PHYSICS))))
def test_what_the_equations_point_to_is_there(path):
    parts = path.split(".")
    for cut in range(len(parts), 0, -1):
        try:
            thing = importlib.import_module(".".join(parts[:cut]))
            break
        except ModuleNotFoundError:
            continue
    for part in parts[cut:]:
        thing = getattr(thing, part)
    assert inspect.getdoc(thing)


def test_the_code_of_the_pages_names_what_there_is():
    for page in (ROOT / "docs").glob("*.md"):
        for alias, package in (("jf", jaxflex), ("ctl", controllers)):
            for name in re.findall(rf"\b{alias}\.(\w+)", page.read_text()):
                assert hasattr(package, name), f"{page.name}: {alias}.{name}"


def test_every_effect_says_what_it_looks_like_differently():
    said = [kind.looks_like for kind in jaxflex.EFFECTS.values()]
    assert all(said) and len(set(said)) == len(said)
