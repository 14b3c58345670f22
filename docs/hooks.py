"""Pages that are made of the code: `{{ effects }}`, `{{ api PACKAGE }}` and `{{ file PATH }}`."""

import importlib
import inspect
import re
from pathlib import Path

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
    return re.sub(r"\{\{ api (\w+) \}\}", lambda found: api(found[1]), markdown)


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
