"""The report of a diagnosis: a page for a person who has never seen the code."""

from collections.abc import Sequence
from pathlib import Path

from ..diagnosis.result import Diagnosis
from ..files.arm_file import ArmFile
from ..plotting_diagnosis import SPECTRUM, VIEWS, plot_force, plot_force_spectrum, plot_gap, plot_prediction
from . import words
from .diagnosis_tables import calibrated_table, effect_table, far_moved, gap_table, where_table
from .report import Picture, bullets, card, grid, paragraph, picture, png, section, tables, write_report

ACCENTS = {
    "nothing_missing": "#3a8f5c",
    "missing_effect": "#2a6f97",
    "ambiguous": "#d09a2a",
    "unexplained": "#c44e52",
}
SHARP = 180  # dots an inch, for screens that show two to a pixel

GAP = (
    "The model is calibrated on a part of the recordings and judged by the rest, which is held out. Before "
    "is the model with calibrated parameters alone, after is the one with what was added. The noise floor "
    "is the part of a channel that no model can predict; a ratio near 1 is as good as can be."
)
PARAMETERS = "Fitted together with what was added, and held to the arm file by the uncertainty stated there."
PREDICTIONS = (
    "Every prediction runs on its own for a second from an estimated start, then starts anew; the measured "
    "line hides those that agree with it, so the error is drawn below. Errors within the dotted lines are "
    "noise of the sensor."
)
FORCES = (
    "What would have to act, moment by moment, for the model to be right: before anything was added, and "
    "after. Its shape is its name. A point is a moment, the line their median, the band "
    "two thirds of them; the few that are far off are left out. What is wrong with a sensor is no force and "
    "has no clear shape here."
)
EVIDENCE = (
    "The evidence of an effect is by how much the squared errors, in units of the noise, rise without it. "
    "Chance alone brings about 10."
)


def draw(found: Diagnosis) -> dict[str, Picture]:
    """Every picture by file name, with its caption and a remark."""
    pictures = {"gap": (plot_gap(found.gap), "Error of every channel, in multiples of its noise", "")}
    if found.comparison is not None:
        for name in found.comparison.measured:
            figure = plot_prediction(found.comparison, name, found.gap.noise_floor[name])
            pictures[f"prediction_{name}"] = (figure, words.channel(name).capitalize(), "")
    if found.forces_before:
        before = found.forces_before[0]
        after = next(force for force in found.forces_after if force.equation == before.equation)
        for key, view in VIEWS.items():
            caption = f"Against {view.axis.partition(' [')[0]}"
            pictures[f"force_{key}"] = (plot_force(view, before, after), caption, view.shapes)
        pictures["force_spectrum"] = (plot_force_spectrum(before, after), "Its frequencies", SPECTRUM)
    return {name: (png(figure, SHARP), title, remark) for name, (figure, title, remark) in pictures.items()}


def write_diagnosis_report(
    path: Path,
    found: Diagnosis,
    file: ArmFile,
    recordings: Sequence[str],
    pictures: dict[str, Picture],
) -> None:
    """Write the page to `path`."""

    def shown(start: str) -> str:
        return grid(*(picture(*p) for name, p in pictures.items() if name.startswith(start)))

    named = [effect_table("What was added to the model", found.effects)] if found.effects else []
    if found.alternatives:
        named.append(effect_table("What explains these data as well, in its place", found.alternatives))
    looks = [
        f"{words.effect_at(e)}: {e.looks_like}."
        for e in (*found.effects, *found.alternatives)
        if e.looks_like
    ]
    sections = [
        paragraph(f"{', '.join(recordings)}; diagnosed in {found.seconds:.0f} s"),
        card(ACCENTS[found.verdict], *map(paragraph, words.answer(found))),
    ]
    if named:
        sections.append(
            section(
                "What is missing",
                tables(named),
                paragraph(EVIDENCE),
                "What each leaves behind:",
                bullets(looks),
            )
        )
    if found.verdict != "nothing_missing" and found.where:
        sections.append(section("Where", tables([where_table(found)])))
    sections += [
        section("The gap, before and after", paragraph(GAP), shown("gap"), tables([gap_table(found)])),
        section("Measured and predicted, on held-out data", paragraph(PREDICTIONS), shown("prediction")),
    ]
    if found.forces_before:
        where = words.equation(found.forces_before[0].equation)
        sections.append(
            section(
                f"The force that would make the model right, in {where}", paragraph(FORCES), shown("force")
            )
        )
    sections += [
        section(
            "Calibrated parameters",
            paragraph(f"{PARAMETERS} {far_moved(found, file)}"),
            tables([calibrated_table(found, file)]),
        ),
        section("What to measure next", paragraph(found.next_experiment)),
        section("The recordings", bullets(found.notes or ["Nothing had to be repaired or left out."])),
    ]
    write_report(path, f"Diagnosis of the {file.arm.name}", sections)
