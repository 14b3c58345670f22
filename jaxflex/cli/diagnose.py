"""`jaxflex diagnose`: from an arm and recordings to what the model lacks."""

import time
from collections.abc import Sequence
from pathlib import Path

from ..diagnosis import Diagnosis
from ..diagnosis import diagnose as find
from ..files.arm_file import ArmFile, read_arm_file, save_arm
from ..files.read_recording import read_recording
from . import words
from .diagnosis_report import draw, write_diagnosis_report
from .diagnosis_tables import calibrated_table, effect_table, far_moved, gap_table, where_table
from .report import save_pictures
from .runtime import console, make_folder
from .tables import write_json

STYLES = {
    "nothing_missing": "bold green",
    "missing_effect": "bold blue",
    "ambiguous": "bold yellow",
    "unexplained": "bold red",
}


def diagnose(arm_file: Path, runs: Sequence[Path], json: Path | None, output: Path | None) -> None:
    """Diagnose, print, draw and write."""
    file = read_arm_file(arm_file)
    recordings = [read_recording(run) for run in runs]
    folder = make_folder(output or Path("diagnosis"))
    console.print(f"[bold]{file.arm.name}[/]: {', '.join(run.name for run in runs)}")
    found = _search(file, recordings)
    show(found, file)
    written = write(found, file, [run.name for run in runs], folder)
    if json:
        write_json(json, found.to_json())
    console.print(f"{found.seconds:.0f} s; wrote {written} to {folder}/")


def _search(file: ArmFile, recordings: Sequence) -> Diagnosis:
    began = time.monotonic()
    with console.status("reading, and finding the noise of each channel") as status:

        def say(line: str) -> None:
            console.print(f"  {time.monotonic() - began:4.0f} s  {line}", markup=False, style="dim")
            status.update(line)

        return find(file, recordings, say)


def show(found: Diagnosis, file: ArmFile) -> None:
    """Print the answer."""
    console.print()
    first, *rest = words.answer(found)
    console.print(first, style=STYLES[found.verdict], markup=False)
    for sentence in rest:
        console.print(sentence, markup=False)
    shown = [effect_table("Added to the model", found.effects)] if found.effects else []
    if found.alternatives:
        shown.append(effect_table("As good in its place", found.alternatives))
    if found.verdict != "nothing_missing" and found.where:
        shown.append(where_table(found))
    shown += [gap_table(found), calibrated_table(found, file)]
    for table in shown:
        console.print()
        console.print(table.rich())
    console.print()
    for text in (far_moved(found, file), f"Next: {found.next_experiment}"):
        if text:
            console.print(text, markup=False)
    for note in found.notes:
        console.print(f"Note: {note}", markup=False)


def write(found: Diagnosis, file: ArmFile, recordings: Sequence[str], folder: Path) -> str:
    """Write report, arm and pictures; returns what was written."""
    pictures = draw(found)
    save_pictures(folder, pictures)
    write_diagnosis_report(folder / "report.html", found, file, recordings, pictures)
    write_json(folder / "report.json", found.to_json())
    save_arm(found.improved, folder / "improved.toml", file.uncertainty)
    return f"report.html, report.json, improved.toml and {len(pictures)} pictures"
