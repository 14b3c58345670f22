"""What is installed is whole: the wheel holds both packages, and its command runs without the repository."""

import json
import os
import subprocess
import sys
import tarfile
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


def run(*command, **options):
    found = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False, **options)
    assert found.returncode == 0, found.stdout + found.stderr
    return found.stdout


def contents(wheel):
    with zipfile.ZipFile(wheel) as stored:
        return stored.namelist()


def check_modes(command, folder, **options):
    run(*command, "modes", "--payloads", "0.05", "--json", "modes.json", "-o", "out", cwd=folder, **options)
    assert len(json.loads((folder / "modes.json").read_text())["driven_hz"][0]) == 7


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    run(sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", folder, ROOT)
    (found,) = folder.glob("jaxflex-*.whl")
    return found


def test_the_wheel_holds_the_packages_and_nothing_else(wheel):
    names = contents(wheel)
    for name in (
        "jaxflex/__init__.py",
        "jaxflex/py.typed",
        "controllers/__init__.py",
        "controllers/py.typed",
    ):
        assert name in names
    assert {name.split("/")[0].split("-")[0] for name in names} == {"jaxflex", "controllers"}
    assert any(name.endswith("licenses/LICENSE") for name in names)
    sources = {
        str(p.relative_to(ROOT)) for part in ("jaxflex", "controllers") for p in (ROOT / part).rglob("*.py")
    }
    assert sources <= set(names)


def test_what_is_installed_runs_without_the_repository(wheel, tmp_path):
    site = tmp_path / "site"
    run(sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", site, wheel)
    environment = {**os.environ, "PYTHONPATH": str(site), "JAXFLEX_CACHE": str(tmp_path / "cache")}
    where = run(
        sys.executable, "-c", "import jaxflex; print(jaxflex.__file__)", cwd=tmp_path, env=environment
    )
    assert where.startswith(str(site))
    check_modes([sys.executable, "-m", "jaxflex"], tmp_path, env=environment)


@pytest.mark.slow
def test_the_wheel_in_an_empty_environment(wheel, tmp_path):
    venv.create(tmp_path / "venv", with_pip=True)
    run(tmp_path / "venv" / "bin" / "pip", "install", "--quiet", wheel)
    plain = {"PATH": os.environ["PATH"], "HOME": str(tmp_path)}
    check_modes([tmp_path / "venv" / "bin" / "jaxflex"], tmp_path, env=plain)


@pytest.mark.slow
def test_the_source_distribution_builds_the_same_wheel(wheel, tmp_path):
    venv.create(tmp_path / "venv", with_pip=True)
    python = tmp_path / "venv" / "bin" / "python"
    run(python, "-m", "pip", "install", "--quiet", "build")
    run(python, "-m", "build", "--sdist", "--outdir", tmp_path, ROOT)
    (archive,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(archive) as stored:
        names = {name.partition("/")[2] for name in stored.getnames()}
    assert {"README.md", "CITATION.cff", "docs/index.md", "tests/test_package.py"} <= names
    run(python, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", tmp_path, archive)
    (again,) = tmp_path.glob("*.whl")
    assert sorted(contents(again)) == sorted(contents(wheel))
