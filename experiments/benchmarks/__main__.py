"""`python -m experiments.benchmarks [QUESTION …] [--reduced] [--fuse] [-o DIR]`."""

import argparse
import json
from pathlib import Path

import jaxflex as jf

parser = argparse.ArgumentParser(description="How fast the library is.")
parser.add_argument("questions", nargs="*", metavar="QUESTION", help="all unless named")
parser.add_argument("--reduced", action="store_true", help="a smaller form, to see that it runs")
parser.add_argument("--fuse", action="store_true", help="with XLA's multi-output fusion, see jaxflex.set_up")
parser.add_argument("-o", type=Path, default=Path(__file__).parent, help="where figures and pictures go")
given = parser.parse_args()
jf.set_up(cache=None, fuse=given.fuse)  # before anything computes, which importing the questions does

from .run import QUESTIONS, run  # noqa: E402

for name in given.questions:
    if name not in QUESTIONS:
        parser.error(f"{name!r} is no question; there are {', '.join(QUESTIONS)}.")
given.o.mkdir(parents=True, exist_ok=True)
figures = run(given.o, given.reduced, tuple(given.questions) or tuple(QUESTIONS))
kept = given.o / "figures.json"  # questions that were not asked keep their answers
before = json.loads(kept.read_text()) if kept.exists() else {}
kept.write_text(json.dumps(before | figures, indent=1) + "\n")
