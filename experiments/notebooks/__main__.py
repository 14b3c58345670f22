"""Run notebooks and store them with their outputs: `python -m experiments.notebooks [NAME …] [--reduced]`."""

import argparse
import time

import nbformat

from .execute import NOTEBOOKS, execute

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("name", nargs="*", help="the beginning of a notebook's name; all unless told")
    parser.add_argument("--reduced", action="store_true", help="the form that the tests run; not stored")
    given = parser.parse_args()
    for path in NOTEBOOKS:
        if given.name and not path.name.startswith(tuple(given.name)):
            continue
        began = time.perf_counter()
        notebook = execute(path, given.reduced)
        if not given.reduced:
            nbformat.write(notebook, path)
        print(f"{path.name}: {time.perf_counter() - began:.0f} s, {path.stat().st_size / 1e3:.0f} kB")
