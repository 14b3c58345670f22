"""A table that prints in a terminal and in a report alike, and JSON that scripts can rely on."""

import html
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rich.markup import escape
from rich.table import Table as RichTable


@dataclass
class Table:
    """Rows of text under `columns`; the first `words` are left-aligned, the row `best` stands out."""

    title: str
    columns: Sequence[str]
    rows: list[Sequence[str]] = field(default_factory=list)
    best: str | None = None
    words: int = 1

    def rich(self) -> RichTable:
        """For the terminal."""
        table = RichTable(
            title=escape(self.title), title_justify="left", title_style="bold", box=None, padding=(0, 1, 0, 0)
        )
        for i, column in enumerate(self.columns):
            table.add_column(escape(column), justify="left" if i < self.words else "right", no_wrap=True)
        for row in self.rows:
            table.add_row(*row, style="bold green" if row[0] == self.best else None)
        return table

    def html(self) -> str:
        """For the report."""

        def cells(tag: str, texts: Sequence[str]) -> str:
            kinds = [" class='words'" if i < self.words else "" for i in range(len(texts))]
            return "".join(
                f"<{tag}{kind}>{html.escape(text)}</{tag}>" for kind, text in zip(kinds, texts, strict=True)
            )

        body = ""
        for row in self.rows:
            mark = ' class="best"' if row[0] == self.best else ""
            body += f"<tr{mark}>{cells('td', row)}</tr>\n"
        return (
            f"<figure><figcaption>{html.escape(self.title)}</figcaption><div class='scroll'>"
            f"<table><thead><tr>{cells('th', self.columns)}</tr></thead><tbody>{body}</tbody></table></div></figure>"
        )


def number(value: float, digits: int = 3) -> str:
    """`value` to so many significant digits, or a dash where there is none."""
    if not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    return f"{value:.{min(places, 6)}f}"


def write_json(path: Path, result: dict[str, Any]) -> None:
    """Write `result`; numbers that are not finite become null, which every reader accepts."""

    def clean(value):
        if isinstance(value, dict):
            return {key: clean(v) for key, v in value.items()}
        if isinstance(value, (list, tuple)):
            return [clean(v) for v in value]
        if isinstance(value, float) and not math.isfinite(value):
            return None
        return value

    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(clean(result), indent=1) + "\n")
