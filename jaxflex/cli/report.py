"""A report in one HTML file that needs nothing else: text, tables and pictures."""

import base64
import html
import io
from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from .tables import Table

STYLE = """
:root { color-scheme: light dark; --ink: #1d2733; --paper: #fcfcfa; --line: #d5d8dc; --best: #e3f1e6;
        --card: #f1f3f2; --soft: #5c6670; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e4e7ea; --paper: #16191d; --line: #3a4048; --best: #1f3a28;
          --card: #1f242a; --soft: #a3adb6; }
  figure img { filter: invert(.9) hue-rotate(180deg); }
}
body { font: 16px/1.55 system-ui, sans-serif; color: var(--ink); background: var(--paper);
       max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.7rem; line-height: 1.25; } h2 { margin-top: 2.2rem; font-size: 1.25rem; }
figure { margin: 1.2rem 0; } figcaption { font-weight: 600; margin-bottom: .4rem; }
figure img { width: 100%; height: auto; background: white; border-radius: 6px; }
figure p, .note { color: var(--soft); font-size: .9rem; margin: .4rem 0; }
.grid { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(24rem, 100%), 1fr)); gap: 0 1.6rem; }
.grid figure { max-width: 32rem; }
.card { background: var(--card); border-left: 6px solid var(--accent, var(--line)); border-radius: 6px;
        padding: .9rem 1.2rem; }
.card > :first-child { font-size: 1.25rem; font-weight: 600; line-height: 1.35; margin-top: 0; }
.card > :last-child { margin-bottom: 0; }
.scroll { overflow-x: auto; }
pre { background: var(--card); border-radius: 6px; padding: .8rem 1rem; overflow-x: auto; font-size: .85rem; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: .88rem; }
th, td { padding: .25rem .6rem; text-align: right; border-bottom: 1px solid var(--line); white-space: nowrap;
         vertical-align: top; }
.words { text-align: left; }
.words:first-child { position: sticky; left: 0; background: var(--paper); min-width: 6.5rem; }
@media (max-width: 32rem) {
  th, td { padding: .25rem .35rem; }
  .words { white-space: normal; }
}
tr.best td, tr.best .words:first-child { background: var(--best); font-weight: 600; }
"""

Picture = tuple[bytes, str, str]  # as a PNG file holds it, caption, and remark


def png(figure: Figure, dpi: int = 130) -> bytes:
    """The image of a figure, as a file holds it."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=dpi)
    return stream.getvalue()


def save_pictures(folder: Path, pictures: dict[str, Picture]) -> None:
    """Write every picture to a file of its name."""
    for name, (image, *_) in pictures.items():
        (folder / f"{name}.png").write_bytes(image)


def picture(image: bytes, caption: str, remark: str = "") -> str:
    """An image in PNG format as HTML; `remark` stands under it."""
    data = base64.b64encode(image).decode()
    words = html.escape(caption)
    return (
        f"<figure><figcaption>{words}</figcaption>"
        f'<img alt="{words}" src="data:image/png;base64,{data}">'
        + (paragraph(remark) if remark else "")
        + "</figure>"
    )


def grid(*parts: str) -> str:
    """Parts side by side where there is room."""
    return f"<div class='grid'>{''.join(parts)}</div>"


def card(accent: str, *parts: str) -> str:
    """Parts that stand out, with an edge of colour `accent`; the first is the largest."""
    return f"<div class='card' style='--accent: {accent}'>{''.join(parts)}</div>"


def bullets(items: Sequence[str]) -> str:
    """A list of plain text."""
    return f"<ul>{''.join(f'<li>{html.escape(item)}</li>' for item in items)}</ul>"


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
