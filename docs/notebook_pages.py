"""The notebooks as pages: text, code and the outputs that are stored with them."""

import base64
import json
import re
from pathlib import Path

from latex2mathml.converter import convert
from mkdocs.structure.files import File, Files

NOTEBOOKS = sorted((Path(__file__).resolve().parents[1] / "experiments" / "notebooks").glob("*.ipynb"))
ENDINGS = {"image/png": "png", "image/gif": "gif"}


def on_files(files: Files, config) -> Files:
    """Add a page, and its pictures, for every notebook."""
    for path in NOTEBOOKS:
        text, pictures = page(path)
        files.append(File.generated(config, f"notebooks/{path.stem}.md", content=text))
        for name, data in pictures.items():
            files.append(File.generated(config, f"notebooks/{path.stem}/{name}", content=data))
    return files


def page(path: Path) -> tuple[str, dict[str, bytes]]:
    """A notebook as Markdown, and the pictures that it refers to by name."""
    parts, pictures = [], {}
    for cell in json.loads(path.read_text())["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(prose(source))
            continue
        parts.append(f"```python\n{source}\n```")
        for output in cell["outputs"]:
            data = output.get("data", {})
            shown = next((kind for kind in ENDINGS if kind in data), None)
            if shown:
                name = f"{len(pictures) + 1}.{ENDINGS[shown]}"
                pictures[name] = base64.b64decode(data[shown])
                parts.append(f"![output of the cell above]({path.stem}/{name})")
            else:
                text = "".join(output.get("text") or data.get("text/plain", ""))
                parts.append(f"```text\n{text.rstrip()}\n```")
    run = f"*From `experiments/notebooks/{path.name}`; `python -m experiments.notebooks` runs them all.*"
    return "\n\n".join([parts[0], run, *parts[1:]]), pictures


def prose(source: str) -> str:
    """Markdown with its formulas as MathML, which needs no script, and links between notebooks."""
    source = re.sub(r"\$\$(.+?)\$\$", lambda found: formula(found[1], "div"), source, flags=re.DOTALL)
    source = re.sub(r"\$([^$]+)\$", lambda found: formula(found[1], "span"), source)
    return re.sub(r"`(\d_\w+)\.ipynb`", r"[`\1`](\1.md)", source)


def formula(tex: str, element: str) -> str:
    """TeX as MathML, on a line of its own in a `div`."""
    text = convert(tex, display="block" if element == "div" else "inline")
    return f'<{element} class="formula">{text}</{element}>'
