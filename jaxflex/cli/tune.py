"""`jaxflex tune`: the main job, from an arm to a design that does not ring."""

import dataclasses
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from controllers import (
    Move,
    Problem,
    Tuned,
    default_move,
    standard_start,
    textbook_pd,
)
from controllers import (
    tune as optimise,
)

from ..analysis.frequencies import locked_frequencies
from ..arm.arm import Arm
from ..arm.library import ahmad_arm
from ..files.arm_file import read_arm_file
from .comparison import (
    STRETCHED,
    TUNED,
    UNTUNED,
    Comparison,
    Contest,
    best_classical,
    comparison_tables,
    together,
)
from .design_file import save_design
from .report import save_pictures
from .runtime import UsageError, console, make_folder, parse_numbers, parse_payloads
from .tables import write_json
from .tune_report import conclusion, draw, write_tune_report

TUNED_ON = 4  # payloads that the search sees


def tune(
    arm_file: Path | None,
    payloads: str,
    move: str | None,
    duration: float | None,
    steps: int,
    seed: int,
    json: Path | None,
    output: Path | None,
) -> None:
    """Tune, compare, print, draw and write."""
    began = time.monotonic()
    file = read_arm_file(arm_file) if arm_file else None
    arm = file.arm if file else ahmad_arm()
    if not any(link.modes for link in arm.links):
        raise UsageError("tune: the arm has no flexible link, so there is no vibration to tune away.")
    if steps < 1:
        raise UsageError(f"--steps {steps}: a whole number of at least 1 is allowed.")
    masses = parse_payloads(payloads)
    folder = make_folder(output)
    console.print(f"[bold]{arm.name}[/]: payloads {payloads} kg")

    middle = arm.with_payload(float(np.median(masses)))
    path = _move(middle, move, duration)
    chosen = tuning_payloads(masses)
    problem = make_problem(middle, chosen, path)
    total = float(problem.total_time())
    console.print(
        f"move of {', '.join(f'{float(a):g}' for a in path.stop)} rad in {float(path.duration):.3g} s, "
        f"{total:.3g} s with the shaper; lowest locked frequency "
        f"{float(locked_frequencies(middle, jnp.stack(path.stop))[0]):.3g} Hz"
    )
    contest = Contest(middle, masses, chosen, path, total, problem.impulses)
    with ThreadPoolExecutor(1) as pool:
        # what owes nothing to the tuning is compared meanwhile, by the program that the rest will need
        untuned = pool.submit(lambda: contest.held(contest.untuned()))
        tuned = _search(problem, steps, seed)
    design = problem.design(tuned.values)
    comparison = together(untuned.result(), contest.held(contest.tuned(design)))
    seconds = time.monotonic() - began
    for table in comparison_tables(comparison):
        console.print(table.rich())
    console.print(conclusion(comparison, tuned, middle))
    uncertainty = file.uncertainty if file else {}
    save_design(folder / "tuned.toml", middle, uncertainty, design)
    pictures = draw(comparison, tuned, chosen)
    save_pictures(folder, pictures)
    write_tune_report(folder / "report.html", comparison, tuned, middle, pictures)
    result = as_json(comparison, tuned, chosen, time.monotonic() - began)
    write_json(json or folder / "tune.json", result)
    console.print(
        f"{seconds:.0f} s; wrote tuned.toml, report.html, tune.json and {len(pictures)} pictures to {folder}/"
    )


def _move(arm: Arm, stop: str | None, duration: float | None) -> Move:
    path = default_move(arm)
    if stop is not None:
        angles = tuple(parse_numbers(stop, "--move", len(arm.joints)))
        path = Move(path.start, angles, path.duration)
    if duration is not None:
        if not duration > 0:
            raise UsageError(f"--duration {duration:g}: a positive number of seconds is allowed.")
        path = Move(path.start, path.stop, duration)
    return path


def search_arm(arm: Arm) -> Arm:
    """The arm with one mode a link, for the search: a sixth of the cost, the same low frequencies.

    The designs are then compared on the arm as given.
    """

    def plain(link):
        return dataclasses.replace(link, modes=min(link.modes, 1), model="assumed_modes")

    return eqx.tree_at(lambda a: a.links, arm, tuple(plain(link) for link in arm.links))


def make_problem(arm: Arm, masses: list[float], path: Move) -> Problem:
    """The tuning problem of an arm: its shaper takes 0.45 and the watch 2 periods of the lowest mode."""
    pose = jnp.stack(path.stop)
    period = 1 / float(locked_frequencies(arm, pose)[0])
    coarse = search_arm(arm)
    start = textbook_pd(coarse, pose, feedforward=True)
    return Problem(coarse, jnp.asarray(masses), path, start, 0.45 * period, watch=2 * period)


def _search(problem: Problem, steps: int, seed: int) -> Tuned:
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[best]}"),
        TimeElapsedColumn(),
    )
    live = console.is_terminal
    with Progress(*columns, console=console, disable=not live) as bar:
        tasks: dict[str, int] = {}

        def progress(what: str, step: int, value: float) -> None:
            text = f"cost {value:.3f}"
            if not live:
                if step == 1 or step % 10 == 0:
                    console.print(f"  {what}, step {step}: {text}")
                return
            if what not in tasks:
                tasks[what] = bar.add_task(what, total=None if what == "starts" else steps, best="")
            bar.update(tasks[what], completed=step, best=text)  # type: ignore[arg-type]

        return optimise(
            problem,
            standard_start(problem),
            starts=6,
            descents=1,
            max_steps=steps,
            seed=seed,
            progress=progress,
        )


def tuning_payloads(masses: list[float]) -> list[float]:
    """At most four of the payloads, spread evenly, both ends included; the rest are held out."""
    count = min(TUNED_ON, len(masses))
    return [masses[round(i)] for i in np.linspace(0, len(masses) - 1, count)]


def as_json(comparison: Comparison, tuned: Tuned, masses: list[float], seconds: float) -> dict:
    """The machine-readable result."""
    keys = {
        "residual_vibration": "residual_vibration_m",
        "settling_time": "settling_time_s",
        "overshoot": "overshoot_pct",
        "peak_voltage": "peak_voltage_V",
        "energy": "energy_J",
        "deflection": "deflection_share",
    }
    designs = {}
    for name, design in comparison.designs.items():
        designs[name] = {"payloads": comparison.payloads.tolist(), "move_time_s": float(design.move_time())}
        for measure, key in keys.items():
            designs[name][key] = comparison.of(measure, name).tolist()
    rival = best_classical(comparison)
    return {
        "designs": designs,
        "tuned": TUNED,
        "untuned": UNTUNED,
        "best_classical": rival,
        "tuned_on": masses,
        "worst_held_out_m": {
            n: comparison.worst(n) for n in (TUNED, UNTUNED, STRETCHED, rival) if n is not None
        },
        "parameters": {name: np.asarray(value).tolist() for name, value in tuned.values.items()},
        "history": [minimum.history for minimum in tuned.minima],
        "stopped": [minimum.reason for minimum in tuned.minima],
        "seconds": seconds,
    }
