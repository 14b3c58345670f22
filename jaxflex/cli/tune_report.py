"""What `jaxflex tune` says of its result: in two sentences, in pictures, and as a page to read or send on."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from matplotlib.figure import Figure

from controllers import GAINS, Design, Tuned

from ..analysis.measures import spectrum
from ..arm.arm import Arm
from ..one_off import one_off
from ..plotting import AFTER, plot_bending, plot_history, plot_residual, plot_spectra
from .comparison import STRETCHED, TUNED, UNTUNED, Comparison, best_classical, comparison_tables
from .report import Picture, bullets, card, grid, paragraph, picture, png, section, tables, write_report
from .tables import Table

DESIGNS = (
    f"{UNTUNED}: gains from a textbook, for an arm that does not bend, on the move as it is.",
    f"{STRETCHED}: the same, the move stretched until it takes as long as the tuned design's.",
    "ZV, ZVD, ZVDD, EI: classical input shapers, two to four parts timed so that their vibrations cancel at the "
    "middle payload; with the textbook's gains, and again with the tuned ones. The move is shortened, so that all "
    "take the same time.",
    "tuned PD, equal time: the tuned gains without a shaper.",
    f"{TUNED}: gains and shaper found together, by gradient through the simulation.",
)
LAW = (
    "Each joint's command is the stiffness gain times the error of its angle, plus the damping gain times the error "
    "of its rate, plus the feedforward gains times rate and acceleration of its reference. The shaper adds up copies "
    "of the move, each delayed by one of the delays and scaled by its amplitude."
)


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


def design_table(design: Design, arm: Arm) -> Table:
    """The parameters of a design; gains in units of what the controller commands."""
    table = Table("parameters of the tuned design", ["parameter", "unit", "values"])
    command = {"voltage": "V", "current": "A", "torque": "N m"}[arm.drive]
    titles = (
        ("stiffness gain", f"{command}/rad"),
        ("damping gain", f"{command} s/rad"),
        ("rate feedforward", f"{command} s/rad"),
        ("acceleration feedforward", f"{command} s²/rad"),
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


@one_off
def _spectra(times: Float[Array, " times"], signals: Float[Array, "payloads times"]) -> tuple[Array, Array]:
    return jax.vmap(lambda signal: spectrum(times, signal))(signals)


def draw(comparison: Comparison, tuned: Tuned, masses: list[float]) -> dict[str, Picture]:
    """The pictures, each with its caption and what to see in it."""
    names, path = list(comparison.designs), comparison.trajectory
    first, last = names.index(UNTUNED), names.index(TUNED)
    times = np.asarray(path.times)[0, 0]
    links = sum(name.startswith("tip_deflection") for name in path.channels)
    bends = np.stack([np.asarray(path[f"tip_deflection_{i + 1}"]) for i in range(links)], axis=-1)
    on = ~comparison.held_out if (~comparison.held_out).any() else comparison.held_out
    ends = [float(comparison.designs[name].move_time()) for name in (UNTUNED, TUNED)]
    late = times >= max(ends)
    shake = np.asarray(path[f"tip_acceleration_{links}"])[:, :, late]
    ours, theirs = (_spectra(jnp.asarray(times[late]), jnp.asarray(shake[k])) for k in (last, first))
    residual = {name: comparison.of("residual_vibration", name) for name in names}
    lowest = 3.0 / (times[-1] - ends[1])
    payloads = comparison.payloads[on].tolist()
    top = 1.05 * float(max(np.abs(bends[k][on]).max() for k in (first, last)))

    def bending(k: int, end: float) -> Figure:
        return plot_bending(times, bends[k][on], end, payloads, top)

    figures = {
        "before": (
            bending(first, ends[0]),
            "Before: textbook controller, plain move",
            "How far the tip of each link is bent away from straight, one curve a payload. What is left after "
            "the dotted line rings.",
        ),
        "after": (
            bending(last, ends[1]),
            "After: tuned controller and shaper",
            "The same with the tuned design, on the same scale.",
        ),
        "residual": (
            plot_residual(comparison.payloads, residual, TUNED, masses),
            "Vibration left after the move, over the payload",
            "Every design but the first takes the same time. Dots are the payloads that the search saw.",
        ),
        "spectra": (
            plot_spectra(
                np.asarray(ours[0])[0], np.asarray(theirs[1]), np.asarray(ours[1]), ("before", "after"),
                "tip acceleration [(m/s²)²/Hz]", 60 * lowest,
            ),
            "Frequencies of what is left",
            "Of each frequency the worst payload. Each step of the scale is a factor in power, so what lies far "
            "below the highest peak does not matter.",
        ),
        "history": (
            plot_history([m.history for m in tuned.minima]),
            "Progress of the search",
            f"The cost is the logarithm of the vibration and of what else counts. The search {tuned.minima[0].reason}.",
        ),
    }  # fmt: skip
    return {name: (png(figure), title, remark) for name, (figure, title, remark) in figures.items()}


def write_tune_report(
    path: Path,
    comparison: Comparison,
    tuned: Tuned,
    arm: Arm,
    pictures: dict[str, Picture],
) -> None:
    """Write the page to `path`."""

    def shown(*names: str) -> str:
        return grid(*(picture(*pictures[name]) for name in names))

    design = comparison.designs[TUNED]
    ours, before = comparison.worst(TUNED), comparison.worst(UNTUNED)
    grams = 1e3 * comparison.payloads
    move = design.move
    joints = ", ".join(
        f"joint {i} by {float(b - a):.3g} rad"
        for i, (a, b) in enumerate(zip(move.start, move.stop, strict=True), 1)
    )
    sections = [
        card(
            AFTER,
            f"<p>After the move the tip rings by {1e3 * ours:.3g} mm; before tuning, by {1e3 * before:.3g} mm.</p>",
            paragraph(conclusion(comparison, tuned, arm)),
        ),
        section(
            "What was asked",
            paragraph(
                f"To move {joints}, with {grams.min():.3g} to {grams.max():.3g} g at the tip, so that the tip is quiet "
                "as soon as the commanded move is over. Residual vibration is how far the tip still goes from the "
                "place where it should rest, peak to peak, joints included."
            ),
            paragraph("A design is a controller, a move, and a shaper that gives the move in parts:"),
            bullets(DESIGNS),
        ),
        section("Before and after", shown("before", "after"), shown("residual", "spectra")),
        section(
            "The tuned design",
            tables([design_table(design, arm)]),
            paragraph(LAW),
            paragraph(
                f"The move takes {float(move.duration):.3g} s, with the shaper {float(design.move_time()):.3g} s. "
                "tuned.toml, beside this page, holds all of it with the arm; jaxflex simulate tuned.toml runs it."
            ),
            shown("history"),
        ),
        section(
            "Every design, every payload",
            paragraph(
                "A star: a payload that the search never saw. A dash: the tip had not settled when the run ended."
            ),
            tables(comparison_tables(comparison)),
        ),
    ]
    write_report(path, f"Tuning of the {arm.name}", sections)
