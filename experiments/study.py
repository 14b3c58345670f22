"""What every experiment shares: one command line, and figures written beside the pictures."""

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from jaxflex import set_up


def command(run: Callable[[Path, bool], dict[str, Any]], file: str) -> None:
    """Run an experiment from the shell: `python -m experiments.NAME [--reduced] [-o DIR]`.

    `run(folder, reduced)` writes its pictures into `folder` and returns its figures, which
    land in `figures.json` there. `reduced` is a smaller form that shows the same.
    """
    parser = argparse.ArgumentParser(description=run.__doc__)
    parser.add_argument("--reduced", action="store_true", help="a smaller form, as the tests run it")
    parser.add_argument("-o", type=Path, default=Path(file).parent, help="where figures and pictures go")
    given = parser.parse_args()
    set_up()
    given.o.mkdir(parents=True, exist_ok=True)
    figures = run(given.o, given.reduced)
    (given.o / "figures.json").write_text(json.dumps(figures, indent=1) + "\n")
