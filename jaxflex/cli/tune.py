"""`jaxflex tune`: the main job, from an arm to a design that does not ring."""

import dataclasses
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from controllers import (
    GAINS,
    Assessment,
    Design,
    Move,
    Problem,
    Tuned,
    assess,
    classical_designs,
    default_move,
    stack,
    standard_start,
    textbook_pd,
    unshaped_design,
    with_payloads,
)
from controllers import (
    tune as optimise,
)

from ..analysis.frequencies import locked_frequencies
from ..analysis.measures import spectrum
from ..arm.arm import Arm
from ..arm.library import ahmad_arm
from ..files.arm_file import read_arm_file
from ..plotting import plot_before_after, plot_history, plot_residual, plot_spectra
from ..simulation.trajectory import Trajectory
from .design_file import save_design
from .report import paragraph, picture, section, tables, write_report
from .runtime import UsageError, console, make_folder, parse_numbers, parse_payloads
from .tables import Table, number, write_json

UNTUNED, TUNED = "PD, untuned", "tuned"
STRETCHED = "PD, untuned, equal time"
TUNED_ON = 4  # payloads that the search sees


@dataclasses.dataclass
class Comparison:
    """Every design on every payload: `held_out` marks the payloads that were not tuned on."""

    designs: dict[str, Design]
    payloads: np.ndarray
    held_out: np.ndarray
    assessment: Assessment
    trajectory: Trajectory

    def of(self, measure: str, name: str) -> np.ndarray:
        """One measure of one design, by payload."""
        return np.asarray(getattr(self.assessment, measure))[list(self.designs).index(name)]

    def worst(self, name: str) -> float:
        """Worst residual vibration [m] over the payloads that were not tuned on."""
        return float(np.max(self.of("residual_vibration", name)[self.held_out]))


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
    with ThreadPoolExecutor(1) as pool:
        # while one core searches, the other compiles the comparison, on a design of the same shape
        first = problem.design(standard_start(problem))
        warm = pool.submit(compare, middle, masses, chosen, path, total, first)
        tuned = _search(problem, steps, seed)
        warm.exception()  # a first design that cannot be simulated is no reason to stop
    design = problem.design(tuned.values)
    comparison = compare(middle, masses, chosen, path, total, design)
    seconds = time.monotonic() - began
    shown = comparison_tables(comparison)
    for table in shown:
        console.print(table.rich())
    verdict = conclusion(comparison, tuned, middle)
    console.print(verdict)
    uncertainty = file.uncertainty if file else {}
    save_design(folder / "tuned.toml", middle, uncertainty, design)
    pictures = draw(comparison, tuned, chosen)
    for name, (figure, _) in pictures.items():
        figure.savefig(folder / f"{name}.png", dpi=130)
    write_report(
        folder / "report.html",
        f"Tuning of the {arm.name}",
        [
            paragraph(verdict),
            section("Payloads", *(picture(*pictures[name]) for name in ("before_after", "residual"))),
            section("Frequencies", picture(*pictures["spectra"])),
            section("Every design, every payload", tables(shown)),
            section("The design", tables([design_table(design)]), picture(*pictures["history"])),
        ],
    )
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
    period = 1 / locked_frequencies(arm, pose)[0]
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


def compare(
    arm: Arm, masses: list[float], chosen: list[float], path: Move, total: float, tuned: Design
) -> Comparison:
    """All designs on the arm as given, over the payloads asked for and those halfway between them."""
    pose = jnp.stack(path.stop)
    untuned = textbook_pd(arm, pose)
    designs = {UNTUNED: unshaped_design(untuned, path), STRETCHED: unshaped_design(untuned, path, total)}
    for name, design in classical_designs(arm, untuned, path, total).items():
        designs[name] = design
    designs["tuned PD, equal time"] = unshaped_design(tuned.controller, path, total)
    for name, design in classical_designs(arm, tuned.controller, path, total).items():
        designs[f"{name}, tuned PD"] = design
    designs[TUNED] = tuned
    between = [(a + b) / 2 for a, b in pairwise(masses)]
    payloads = np.array(sorted(masses + between))
    held_out = ~np.isin(payloads, chosen)
    if not held_out.any():
        held_out[:] = True  # a single payload: it is all there is to judge by
    watch = 2.0 / float(locked_frequencies(arm, pose)[0])
    times = jnp.linspace(0.0, total + watch, 1201)
    assessment, trajectory = assess(
        stack(list(designs.values())), with_payloads(arm, jnp.asarray(payloads)), times
    )
    trajectory.check()
    return Comparison(designs, payloads, held_out, assessment, trajectory)


def comparison_tables(comparison: Comparison) -> list[Table]:
    """One table a measure: designs down, payloads across; held-out payloads carry a star."""
    heads = [
        f"{1e3 * mass:.3g}{'*' if out else ''}"
        for mass, out in zip(comparison.payloads, comparison.held_out, strict=True)
    ]
    measures = [
        ("residual_vibration", "residual tip vibration after the move, peak to peak [mm]", 1e3),
        ("settling_time", "settling time of the tip into 1 % of its travel [s]", 1.0),
        ("overshoot", "overshoot of the tip [%]", 1.0),
        ("peak_voltage", "peak motor voltage [V]", 1.0),
        ("deflection", "largest tip deflection [% of the link's length]", 100.0),
    ]
    result = []
    for measure, title, scale in measures:
        table = Table(f"{title}; payload in g, * never tuned on", ["design", "move [s]", *heads], best=TUNED)
        for name, design in comparison.designs.items():
            values = comparison.of(measure, name) * scale
            table.rows.append([name, f"{float(design.move_time()):.2f}", *(number(float(v)) for v in values)])
        result.append(table)
    return result


def best_classical(comparison: Comparison) -> str | None:
    """The classical shaper with the tuned gains of least vibration at equal move time, if there is any."""
    names = [name for name in comparison.designs if name.endswith(", tuned PD")]
    return min(names, key=comparison.worst, default=None)


def conclusion(comparison: Comparison, tuned: Tuned, arm: Arm) -> str:
    """What came out, in two sentences."""
    ours = comparison.worst(TUNED)
    rival = best_classical(comparison)
    peak = float(np.max(comparison.of("peak_voltage", TUNED)))
    limits = [
        float(joint.motor.voltage_limit)
        for joint in arm.joints
        if joint.motor is not None and joint.motor.voltage_limit is not None
    ]
    voltage = f", at {peak:.3g} V of {min(limits):g} V" if limits else ""
    steps = sum(minimum.steps for minimum in tuned.minima)
    against = (
        "no mode rings under the tuned gains, so there is no classical shaper to compare with"
        if rival is None
        else f"{1e3 * comparison.worst(rival):.3g} mm for the best classical shaper with the tuned gains at "
        f"equal time, {rival.split(',')[0]} ({comparison.worst(rival) / ours:.3g} times as much)"
    )
    return (
        f"Worst residual vibration over payloads never tuned on: {1e3 * ours:.3g} mm for the tuned design"
        f"{voltage}; {1e3 * comparison.worst(UNTUNED):.3g} mm for the untuned PD "
        f"({comparison.worst(UNTUNED) / ours:.3g} times as much), "
        f"{1e3 * comparison.worst(STRETCHED):.3g} mm with its move stretched to equal time, and "
        f"{against}. "
        f"The search took {steps} steps and {tuned.minima[0].reason}."
    )


def design_table(design: Design) -> Table:
    """The parameters of a design."""
    table = Table("parameters of the tuned design", ["parameter", "unit", "values"])
    titles = (
        ("stiffness gain", "V/rad"),
        ("damping gain", "V s/rad"),
        ("rate feedforward", "V s/rad"),
        ("acceleration feedforward", "V s²/rad"),
    )
    gains = [getattr(design.controller, name) for name in GAINS]
    rows = [(*title, values) for title, values in zip(titles, gains, strict=True)]
    rows += [
        ("shaper amplitudes", "1", design.shaper.amplitudes),
        ("shaper delays", "s", design.shaper.delays),
    ]
    for title, unit, values in rows:
        table.rows.append([title, unit, "  ".join(f"{float(v):.4g}" for v in values)])
    return table


def draw(comparison: Comparison, tuned: Tuned, masses: list[float]) -> dict:
    """The pictures, each with its caption."""
    names, path = list(comparison.designs), comparison.trajectory
    first, last = names.index(UNTUNED), names.index(TUNED)
    times = np.asarray(path.times)[0, 0]
    links = sum(name.startswith("tip_deflection") for name in path.channels)
    bends = np.stack([np.asarray(path[f"tip_deflection_{i + 1}"]) for i in range(links)], axis=-1)
    on = ~comparison.held_out if (~comparison.held_out).any() else comparison.held_out
    ends = (
        float(comparison.designs[UNTUNED].move_time()),
        float(comparison.designs[TUNED].move_time()),
    )
    late = times >= max(ends)
    shake = path[f"tip_acceleration_{links}"][:, :, late]
    ours, theirs = (
        jax.vmap(lambda signal: spectrum(jnp.asarray(times[late]), signal))(shake[k]) for k in (last, first)
    )
    residual = {name: comparison.of("residual_vibration", name) for name in names}
    lowest = 3.0 / (times[-1] - ends[1])
    return {
        "before_after": (
            plot_before_after(
                times, bends[first][on], bends[last][on], ends, comparison.payloads[on].tolist(),
                ("untuned PD, unshaped", "tuned PD and shaper"),
            ),
            "Tip deflection for every tuning payload, before and after",
        ),
        "residual": (
            plot_residual(comparison.payloads, residual, TUNED, masses),
            "Residual tip vibration against payload, every design at equal move time but the first",
        ),
        "spectra": (
            plot_spectra(
                np.asarray(ours[0])[0], np.asarray(theirs[1]), np.asarray(ours[1]),
                ("untuned PD, unshaped", "tuned PD and shaper"),
                "tip acceleration after the move [(m/s²)²/Hz]", 60 * lowest,
            ),
            "Spectral density of tip acceleration after the move, worst payload at each frequency",
        ),
        "history": (plot_history([m.history for m in tuned.minima]), "Progress of the search"),
    }  # fmt: skip


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
