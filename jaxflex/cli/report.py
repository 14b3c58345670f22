"""A report in one HTML file that needs nothing else: text, tables and pictures."""

import base64
import html
import io
from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from .tables import Table

STYLE = """
:root { color-scheme: light dark; --ink: #1d2733; --paper: #fcfcfa; --line: #d5d8dc; --best: #e3f1e6; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e4e7ea; --paper: #16191d; --line: #3a4048; --best: #1f3a28; }
}
body { font: 16px/1.55 system-ui, sans-serif; color: var(--ink); background: var(--paper);
       max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.7rem; line-height: 1.25; } h2 { margin-top: 2.2rem; font-size: 1.25rem; }
figure { margin: 1.2rem 0; } figcaption { font-weight: 600; margin-bottom: .4rem; }
figure img { width: 100%; height: auto; background: white; border-radius: 6px; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .88rem; }
th, td { padding: .25rem .6rem; text-align: right; border-bottom: 1px solid var(--line); white-space: nowrap; }
th:first-child, td:first-child { text-align: left; }
tr.best td { background: var(--best); font-weight: 600; }
"""


def picture(figure: Figure, caption: str) -> str:
    """A figure as HTML, the image inside."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=130)
    data = base64.b64encode(stream.getvalue()).decode()
    words = html.escape(caption)
    return (
        f"<figure><figcaption>{words}</figcaption>"
        f'<img alt="{words}" src="data:image/png;base64,{data}"></figure>'
    )


def section(title: str, *parts: str) -> str:
    """A heading and what stands under it."""
    return f"<h2>{html.escape(title)}</h2>\n" + "\n".join(parts)


def paragraph(text: str) -> str:
    """A paragraph of plain text."""
    return f"<p>{html.escape(text)}</p>"


def tables(items: Sequence[Table]) -> str:
    """Several tables, one below the other."""
    return "\n".join(table.html() for table in items)


def write_report(path: Path, title: str, sections: Sequence[str]) -> None:
    """Write the report to `path`."""
    path.write_text(
        "<!doctype html>\n<html lang='en'><head><meta charset='utf-8'>"
        "<meta name='viewport' content='width=device-width, initial-scale=1'>"
        f"<title>{html.escape(title)}</title><style>{STYLE}</style></head>\n"
        f"<body><h1>{html.escape(title)}</h1>\n" + "\n".join(sections) + "\n</body></html>\n"
    )
