"""Each floor imports only floors below it."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
FLOORS = [
    ["jaxflex.brief", "jaxflex.kept"],
    ["jaxflex.one_off"],
    ["jaxflex.scalars", "jaxflex.trigonometry", "jaxflex.session", "jaxflex.sweep", "jaxflex.timing"],
    ["jaxflex.beam", "jaxflex.motor", "jaxflex.effects"],
    ["jaxflex.arm"],
    ["jaxflex.dynamics"],
    ["jaxflex.sensors", "jaxflex.drive", "jaxflex.control"],
    ["jaxflex.simulation"],
    ["jaxflex.analysis", "jaxflex.files", "jaxflex.plotting", "jaxflex.plotting_run"],
    ["jaxflex.diagnosis", "jaxflex.ringing"],
    ["jaxflex"],
    ["controllers"],
    ["jaxflex.cli"],
    ["jaxflex.__main__"],
    ["experiments"],
]


def floor(module: str) -> int:
    best = max(
        (len(name), height)
        for height, names in enumerate(FLOORS)
        for name in names
        if module == name or module.startswith(name + ".")
    )
    return best[1]


def modules():
    for package in ("jaxflex", "controllers"):
        for path in sorted((ROOT / package).rglob("*.py")):
            parts = path.relative_to(ROOT).with_suffix("").parts
            if parts[-1] == "__init__" and len(parts) == 1:
                continue
            yield path, parts


@pytest.mark.parametrize(
    "path, parts", list(modules()), ids=lambda p: "/".join(p) if isinstance(p, tuple) else ""
)
def test_imports_run_downwards(path, parts):
    inside = parts[:-1] if parts[-1] == "__init__" else parts
    here = ".".join(inside)
    package = list(parts[:-1])
    for node in ast.walk(ast.parse(path.read_text())):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            names = [".".join([*base, *(node.module.split(".") if node.module else [])])]
        for name in names:
            if name.split(".")[0] in ("jaxflex", "controllers"):
                assert floor(name) <= floor(here), f"{here} (lower floor) imports {name}"


def test_controllers_use_public_names_only():
    for path in (ROOT / "controllers").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module and node.level == 0:
                assert not node.module.startswith("jaxflex."), f"{path.name} imports {node.module}"


def test_files_stay_small():
    lengths = [len(path.read_text().splitlines()) for path, _ in modules()]
    assert max(lengths) <= 400


def test_import_has_no_side_effects():
    import subprocess
    import sys

    code = "import jaxflex, controllers, jax, os\nassert not jax.config.jax_enable_x64\n"
    code += "assert 'XLA_FLAGS' not in os.environ"
    subprocess.run([sys.executable, "-c", code], check=True, env={"PATH": "", "PYTHONPATH": str(ROOT)})
