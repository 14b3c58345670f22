"""How often does `diagnose` name what is hidden? One line a case, then the confusion matrix.

`python -m experiments.diagnosis_matrix CASES [-o DIR] [--share 0/2] [--only WORD]`: CASES is a folder
of case folders as `python -m experiments.blind.make` writes them. What is hidden is read
after the answer was given, from `truth.json`.
"""

import argparse
import json
import math
import time
from pathlib import Path
from typing import Any

import jax

import jaxflex as jf
from jaxflex.diagnosis import diagnose

FLOOR = 1.2  # of the noise: held-out error after the fix that counts as gone
SAID = {True: "met", False: "off", None: ""}
CLOSE = 0.05  # of a parameter that counts as found
ALIKE = 3  # names in an ambiguous answer, at most, for it to count as right


def judge(folder: Path) -> dict[str, Any]:
    """Diagnose one case and compare the answer with what is hidden."""
    file = jf.read_arm_file(folder / "arm.toml")
    recordings = [jf.read_recording(path) for path in sorted(folder.glob("run_*.csv"))]
    began = time.perf_counter()
    answer = diagnose(file, recordings)
    seconds = time.perf_counter() - began
    truth = json.loads((folder / "truth.json").read_text())
    hidden = [entry["name"] for entry in truth["hidden"]]
    named = [effect.name for effect in answer.effects]
    others = [effect.name for effect in answer.alternatives]
    ratios = [answer.gap.after[c] / answer.gap.noise_floor[c] for c in answer.gap.after]
    return {
        "case": folder.name,
        "hidden": hidden,
        "gap": truth["gap"].get("wanted"),
        "verdict": answer.verdict,
        "named": named,
        "alternatives": others,
        "parameters": {
            e.name: {k: [v.value, v.std] for k, v in e.parameters.items()} for e in answer.effects
        },
        "truth": truth["hidden"],
        "after_over_floor": max(ratios),
        "explained": answer.explained,
        "seconds": seconds,
        "right": right(hidden, answer.verdict, named, others),
    }


def _without_company(hidden: list[str], named: list[str]) -> list[str]:
    """The blind plants' Stribeck and asymmetric friction sit on a Coulomb level, which may be named too."""
    sits_on_level = {"stribeck_friction", "asymmetric_friction"} & set(hidden)
    return [name for name in named if not (sits_on_level and name == "coulomb_friction")]


def right(hidden: list[str], verdict: str, named: list[str], others: list[str]) -> bool:
    """True if the answer is the right one for what is hidden."""
    named = _without_company(hidden, named)
    if not hidden:
        return verdict == "nothing_missing"
    if any(name.startswith("outside:") for name in hidden):
        return verdict == "unexplained"
    if len(hidden) > 1:
        return set(hidden) <= set(named) | set(others)
    if verdict == "ambiguous":
        return hidden[0] in (named + others) and len(named) + len(others) <= ALIKE
    return verdict == "missing_effect" and named[:1] == hidden


def met(result: dict[str, Any]) -> bool | None:
    """True if every parameter of what is hidden is within 5 % or two standard deviations; None if not named."""
    found = []
    for effect in result["truth"]:
        if effect["name"] not in result["named"]:
            return None
        for key, true in effect["values"].items():
            value, std = result["parameters"][effect["name"]].get(key, (true, 0.0))
            found.append(abs(value - true) <= max(CLOSE * abs(true), 2 * std))
    return all(found) if found else None


def wilson(hits: int, count: int) -> tuple[float, float]:
    """The 95 % interval of a rate."""
    if count == 0:
        return 0.0, 1.0
    z, p = 1.96, hits / count
    middle = (p + z * z / (2 * count)) / (1 + z * z / count)
    half = z / (1 + z * z / count) * math.sqrt(p * (1 - p) / count + z * z / (4 * count * count))
    return middle - half, middle + half


def summary(results: list[dict[str, Any]]) -> str:
    """Rates with Wilson intervals, and the confusion matrix, as Markdown."""
    groups: dict[str, list[dict[str, Any]]] = {}
    for result in results:
        hidden = result["hidden"]
        kind = (
            "nothing hidden" if not hidden
            else "outside the catalogue" if any(h.startswith("outside:") for h in hidden)
            else "two effects" if len(hidden) > 1
            else "one effect"
        )  # fmt: skip
        gap = "" if result["gap"] is None else f", gap {result['gap']:g}"
        groups.setdefault(kind + gap, []).append(result)
    lines = ["| cases | number | right | rate | 95 % interval |", "|---|---|---|---|---|"]
    for kind in sorted(groups):
        found = groups[kind]
        hits = sum(result["right"] for result in found)
        low, high = wilson(hits, len(found))
        lines.append(f"| {kind} | {len(found)} | {hits} | {hits / len(found):.0%} | {low:.0%}–{high:.0%} |")
    named = [r for r in results if r["right"] and r["hidden"] and r["verdict"] != "unexplained"]
    gone = sum(r["after_over_floor"] <= FLOOR for r in named)
    judged = [verdict for verdict in map(met, named) if verdict is not None]
    lines += [
        "",
        f"Of {len(named)} cases whose effects were named, {gone} are held out within {FLOOR} times the noise floor; "
        f"of {len(judged)} with the effect itself in first place, {sum(judged)} have every parameter within "
        f"{CLOSE:.0%} or two stated standard deviations.",
        "",
        "| hidden | gap | verdict | named | instead of | after / floor | parameters | s | right |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for result in sorted(results, key=lambda r: (r["hidden"], r["gap"] or 0)):
        lines.append(
            f"| {' + '.join(result['hidden']) or 'nothing'} | {result['gap'] or ''} | {result['verdict']} "
            f"| {', '.join(result['named'])} | {', '.join(result['alternatives'])} "
            f"| {result['after_over_floor']:.2f} | {SAID[met(result)]} "
            f"| {result['seconds']:.0f} | {'yes' if result['right'] else 'no'} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", type=Path)
    parser.add_argument("-o", type=Path, default=Path(__file__).parent)
    parser.add_argument("--share", default="0/1", help="k/n: every n-th case, from the k-th")
    parser.add_argument("--only", default="", help="cases whose name contains this")
    given = parser.parse_args()
    jf.set_up(fuse=True)
    given.o.mkdir(parents=True, exist_ok=True)
    part, of = map(int, given.share.split("/"))
    folders = sorted(p.parent for p in given.cases.glob("*/arm.toml") if given.only in p.parent.name)
    log = given.o / "results.jsonl"
    done = [json.loads(line) for line in log.read_text().splitlines()] if log.exists() else []
    seen = {result["case"] for result in done}
    for folder in folders[part::of]:
        if folder.name in seen:
            continue
        try:
            result = judge(folder)
        except (ValueError, ArithmeticError) as error:
            result = {"case": folder.name, "error": repr(error)}
        with log.open("a") as stream:
            stream.write(json.dumps(result) + "\n")
        jax.clear_caches()  # programs of some forty cases are more than one process may map
        print(
            json.dumps(
                {k: result.get(k) for k in ("case", "verdict", "named", "alternatives", "right", "error")}
            ),
            flush=True,
        )
    results = [json.loads(line) for line in log.read_text().splitlines()]
    (given.o / "results.md").write_text(summary([r for r in results if "error" not in r]))


if __name__ == "__main__":
    main()
