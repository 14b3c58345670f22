"""Pages made of the repository: `{{ effects }}`, `{{ api PACKAGE }}`, `{{ file PATH }}`, `{{ experiment NAME }}`."""

import importlib
import inspect
import re
from pathlib import Path

from mkdocs.structure.files import File, Files

from jaxflex import EFFECTS

ROOT = Path(__file__).resolve().parents[1]
PLACES = {
    "joint": "At a joint",
    "motor": "In a motor and its amplifier",
    "link": "In a link",
    "tip": "At the tip",
    "base": "At the base",
    "channel": "In an instrument",
}


def on_page_markdown(markdown: str, **_) -> str:
    """Fill in what the code says."""
    markdown = markdown.replace("{{ effects }}", effects())
    markdown = re.sub(r"\{\{ file (\S+) \}\}", lambda found: (ROOT / found[1]).read_text(), markdown)
    markdown = re.sub(r"\{\{ experiment (\S+) \}\}", lambda found: experiment(found[1]), markdown)
    return re.sub(r"\{\{ api (\w+) \}\}", lambda found: api(found[1]), markdown)


def on_files(files: Files, config) -> Files:
    """Add the pictures of the experiments that pages tell of."""
    for page in (ROOT / "docs").glob("*.md"):
        text = page.read_text()
        told = re.findall(r"\{\{ experiment (\w+) \}\}", text) + re.findall(r"\]\((\w+)/\w+\.png\)", text)
        for name in told:
            for path in (ROOT / "experiments" / name).glob("*.png"):
                files.append(File.generated(config, f"{name}/{path.name}", abs_src_path=str(path)))
    return files


def experiment(name: str) -> str:
    """What an experiment found, from its README, its headings one level down and its pictures beside the page."""
    text = (ROOT / "experiments" / name / "README.md").read_text()
    text = re.sub(r"^#", "##", text, flags=re.M)
    text = re.sub(r"(?<!!)\[([^]]*)\]\((?!http)[^)]+\)", r"\1", text)  # to files that stay where they are
    return re.sub(r"!\[([^]]*)\]\(([^)]+)\)", rf"![\1]({name}/\2)", text)


def effects() -> str:
    """The catalogue, by place, then every effect with its residual, parameters and equation."""
    lines = ["| if your residual shows … | it may be | parameters |", "|---|---|---|"]
    for name, kind in EFFECTS.items():
        units = ", ".join(f"`{key}` [{unit}]" for key, unit in kind.units.items())
        lines.append(f"| {kind.looks_like} | [`{name}`](#{name}) | {units} |")
    for place, title in PLACES.items():
        lines += ["", f"## {title}", ""]
        for name, kind in EFFECTS.items():
            if kind.place == place:
                lines += [f"### `{name}` {{ #{name} }}", "", inspect.getdoc(kind) or "", ""]
                lines += [f"*In a residual:* {kind.looks_like}.", ""]
    return "\n".join(lines)


def api(package: str) -> str:
    """Every public name of a package, under the module that defines it."""
    module = importlib.import_module(package)
    groups: dict[str, list[str]] = {}
    for name in dict.fromkeys([*vars(module), *dir(module)]):
        thing = getattr(module, name)
        home = getattr(thing, "__module__", None) or ""
        if name.startswith("_") or inspect.ismodule(thing) or not home.startswith(package + "."):
            continue
        defined = getattr(thing, "__qualname__", None) or getattr(thing, "__name__", name)
        groups.setdefault(home, []).append(f"::: {home}.{defined}")
    lines = []
    for home, entries in groups.items():
        about = (inspect.getdoc(importlib.import_module(home)) or "").split("\n\n")[0].replace("\n", " ")
        lines += [f"## {home.partition('.')[2]}", "", about, "", *(f"{entry}\n" for entry in entries)]
    return "\n".join(lines)
