"""Make recordings with a hidden effect: `python -m experiments.blind.make -o DIR`."""

import argparse
import itertools
import json
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import numpy as np

from .drive import record
from .effects import available
from .gaps import measure
from .outside import CATALOGUE, OUTSIDE
from .rigs import NOISE, RUNS, SAMPLES, UNITS, Rig, generator, true_rig
from .simulator import CHANNELS, COUNT, SAMPLE
from .sizes import COARSE, find_sizes, hide
from .typical import TYPICAL

FINE = 40  # steps a sample: 20 kHz
COLOUR = 0.9  # correlation of coloured noise from one sample to the next
Truth = tuple[tuple[str, str, dict[str, float]], ...]


@dataclass(frozen=True)
class Case:
    """An arm file, two recordings, and what is hidden in them.

    - `truth`: (effect, location, values) of each hidden effect; empty for nothing. Names
      that begin with `outside:` are in no catalogue
    - `arm_toml`: the text of the nominal arm file
    - `runs`: a dict of columns a run, by header, such as `"angle_1 [rad]"`
    - `gap`: `wanted`, None for a typical size; `raw` and `projected` over the noise floor, by channel; `size`, the
      projected gap in the channel where it is largest; `survival`; `reached`, false where
      no believable size of the effect gives the gap wanted
    """

    name: str
    truth: Truth
    arm_toml: str
    runs: list[dict[str, np.ndarray]]
    gap: dict[str, Any]


def make_cases(
    plant: str,
    effects: list[tuple[str, ...]],
    gaps: list[float],
    seeds: list[int],
    noise: str = "white",
    also: tuple[str, ...] = (),
    typical: bool = False,
) -> list[Case]:
    """Cases for every combination; `()` among the effects is nothing hidden, once a seed.

    In a case with several effects each has, alone, the gap asked for. A case whose control loop
    is unstable is left out, with a warning. `noise` is `"white"` or
    `"coloured"`; `also`: channels to log beside the usual, `"rate"` and `"strain"`.
    `typical`: `gaps` are no gaps, but multiples of the sizes that such a rig has.
    """
    known = available(plant)
    for name in itertools.chain.from_iterable(effects):
        if name not in known:
            raise ValueError(f"{name!r} cannot be hidden in {plant!r}; there are {', '.join(known)}.")
    jobs = [(e, g, s) for e in effects for g in (gaps if e else [0.0]) for s in seeds]
    keys = list(dict.fromkeys((e, s) for e, _, s in jobs))
    plain = dict(zip(keys, with_peaks([true_rig(plant, key, also) for key in keys]), strict=True))
    singles = list(dict.fromkeys(((e, s), name, g) for e, g, s in jobs for name in e))
    if typical:
        sizes = [min(g * TYPICAL[name], known[name].most) for _, name, g in singles]
    else:
        sizes = find_sizes([(plain[key], key, name, g) for key, name, g in singles])
    size_of = dict(zip(singles, sizes, strict=True))
    rigs, truths = [], []
    for names, gap, seed in jobs:
        rig, truth = plain[names, seed].copy(), []
        for name in names:
            size = size_of[(names, seed), name, gap]
            location, values = hide(rig, (names, seed), name, size)
            truth.append((name, location, {k: float(v) for k, v in values.items()}))
        rigs.append(rig)
        truths.append(tuple(truth))
    measured, voltage, read = measure([plain[e, s] for e, _, s in jobs], rigs, FINE)
    cases = []
    for n, (names, gap, seed) in enumerate(jobs):
        figures = measured[n]
        if not np.isfinite(figures.size):
            warnings.warn(
                f"{names}, gap {gap:g}, seed {seed} is left out: its loop is unstable.", stacklevel=2
            )
            continue
        title = "+".join(names).replace(":", "_") or "nothing"
        found = {
            "wanted": None if typical else gap, "raw": figures.raw, "projected": figures.projected,
            "size": figures.size, "survival": figures.survival,
            "reached": bool(typical or not names or figures.size > 0.7 * gap),
        }  # fmt: skip
        draw = generator(plant, names, gap, seed, noise)
        runs = [
            columns(rigs[n], voltage[:, :, n, r], read[..., n, r], generator_noise(draw, noise))
            for r in range(RUNS)
        ]
        name = f"{title}-{gap:g}-{seed}" if names else f"{title}-{seed}"
        cases.append(Case(name, truths[n], rigs[n].nominal.toml(), runs, found))
    return cases


def with_peaks(rigs: list[Rig]) -> list[Rig]:
    """The rigs, knowing how far they go with nothing hidden."""
    voltage, read, _ = record(rigs, COARSE)
    for n, rig in enumerate(rigs):
        rig.peak = {"voltage": np.abs(voltage[:, :, n]).max(axis=(0, 2)), "angle": read[:, 0, 0, n].max()}
    return rigs


def generator_noise(draw: np.random.Generator, kind: str):
    """A function of a standard deviation, which returns a noise of that size."""
    if kind not in ("white", "coloured"):
        raise ValueError(f"noise = {kind!r}; allowed are 'white' and 'coloured'.")

    def noise(deviation: float) -> np.ndarray:
        out = draw.standard_normal(SAMPLES)
        if kind == "coloured":
            for k in range(1, SAMPLES):
                out[k] = COLOUR * out[k - 1] + np.sqrt(1 - COLOUR**2) * out[k]
        return deviation * out

    return noise


def columns(rig: Rig, voltage: np.ndarray, read: np.ndarray, noise) -> dict[str, np.ndarray]:
    """One run as it is logged: the encoder counts, everything else has noise."""
    joints = range(rig.nominal.joints)
    out = {"time [s]": np.arange(SAMPLES) * SAMPLE}
    out |= {f"voltage_{j + 1} [V]": voltage[:, j] for j in joints}
    for channel in rig.nominal.channels:
        for j in joints:
            signal = read[:, CHANNELS.index(channel), j]
            counted = np.round(signal / COUNT) * COUNT
            value = counted if channel == "angle" else signal + noise(NOISE[channel])
            out[f"{channel}_{j + 1} [{UNITS[channel]}]"] = value
    return out


def write_case(case: Case, folder: str | Path) -> None:
    """Write `arm.toml`, `run_1.csv`, `run_2.csv` and `truth.json` into `folder`."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "arm.toml").write_text(case.arm_toml)
    for number, run in enumerate(case.runs, 1):
        table = np.stack(list(run.values()), axis=1)
        shape = ["%.4f"] + ["%.7g"] * (table.shape[1] - 1)
        np.savetxt(
            folder / f"run_{number}.csv", table, fmt=shape, delimiter=",", header=",".join(run), comments=""
        )
    hidden = [{"name": n, "location": where, "values": values} for n, where, values in case.truth]
    truth = {"name": case.name, "hidden": hidden, "gap": case.gap}
    (folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n")


def chosen(plant: str, words: str) -> list[tuple[str, ...]]:
    """Effects from the command line: `all`, `outside`, `nothing`, or names; `a+b` for a pair."""
    known = available(plant)
    out: list[tuple[str, ...]] = []
    for word in words.split(","):
        groups = {"all": CATALOGUE, "outside": OUTSIDE}
        if word in groups:
            out += [(name,) for name in groups[word] if name in known]
        else:
            out.append(() if word == "nothing" else tuple(word.split("+")))
    return out


def main() -> None:
    """Write one folder a case."""
    jax.config.update("jax_enable_x64", True)
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", type=Path, required=True, help="where the folders go")
    parser.add_argument("--plant", default="single_link")
    parser.add_argument("--effects", default="all", help="all, outside, nothing, or names; a+b for a pair")
    parser.add_argument("--gaps", default="1,3,10", help="projected gap over the noise floor")
    parser.add_argument(
        "--typical", action="store_true", help="gaps are multiples of the sizes such a rig has"
    )
    parser.add_argument("--seeds", type=int, default=3, help="how many")
    parser.add_argument("--first", type=int, default=0, help="the first of the seeds")
    parser.add_argument("--noise", default="white", choices=["white", "coloured"])
    parser.add_argument("--also", default="", help="channels to log beside the usual: rate,strain")
    given = parser.parse_args()
    gaps = [float(g) for g in given.gaps.split(",")]
    cases = make_cases(
        given.plant,
        chosen(given.plant, given.effects),
        gaps,
        list(range(given.first, given.first + given.seeds)),
        given.noise,
        tuple(filter(None, given.also.split(","))),
        given.typical,
    )
    for case in cases:
        write_case(case, given.o / case.name)
        size, survival = case.gap["size"], case.gap["survival"]
        print(f"{case.name:45s} gap {size:7.2f}  survival {survival:5.2f}  {case.truth}")


if __name__ == "__main__":
    main()
