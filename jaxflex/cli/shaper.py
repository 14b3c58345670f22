"""`jaxflex shaper`: from recordings, or from an arm, to the shaper to use."""

import html
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from controllers import ALTERNATING, Rated, rate_shapers, recommend, residual_curve

from ..files.read_recording import read_recording
from ..plotting_shaper import plot_shapers
from ..ringing import MeasuredMode, measure_modes
from ..ringing.stretches import INPUTS, spectrum_of
from .report import bullets, card, paragraph, picture, png, section, tables, write_report
from .runtime import UsageError, console, make_folder, parse_payloads
from .shaper_model import modes_of_arm
from .tables import Table, number, write_json

DRAWN = 1200  # frequencies of the picture
EXPLAINED = (
    "Vibration left is the worst over the spread of frequency and damping, as a share of the vibration of an "
    "unshaped move; with several modes, of all of them together, each counted by its size. Added time is that "
    "by which the command gets longer. UM shapers have negative impulses, ask the drive for twice the "
    "acceleration and may excite higher modes: they are listed, and not recommended."
)


class Found(NamedTuple):
    """What rings, from either source: modes by size, spectrum, and words about the data."""

    title: str
    modes: tuple[MeasuredMode, ...]
    frequencies: np.ndarray
    spectrum: np.ndarray
    warnings: tuple[str, ...]
    used: tuple[str, ...]


def shaper(
    files: Sequence[Path],
    payloads: str | None,
    driven_by: str | None,
    tolerance: float,
    json: Path | None,
    output: Path | None,
) -> None:
    """Find the modes, rate the shapers, print, draw and write."""
    if not 0 < tolerance < 1:
        raise UsageError(f"--tolerance {tolerance:g}: allowed is more than 0 and less than 1.")
    recordings = [file for file in files if file.suffix.lower() != ".toml"]
    if recordings and len(recordings) < len(files):
        raise UsageError("an arm and recordings are given: one arm.toml, or recordings, are allowed.")
    if len(files) > 1 and not recordings:
        raise UsageError(f"{len(files)} arms are given: one arm.toml, or recordings, are allowed.")
    if driven_by is not None and not recordings:
        raise UsageError("--input: allowed with recordings only.")
    if driven_by is not None and driven_by not in INPUTS:
        raise UsageError(f"--input {driven_by}: allowed are {', '.join(INPUTS)}.")
    if recordings and payloads is not None:
        raise UsageError(
            "--payloads: allowed with an arm only; recordings show the payloads they were made with."
        )
    if recordings:
        found = _from_recordings(recordings, driven_by)
    else:
        masses = None if payloads is None else parse_payloads(payloads)
        found = Found(*modes_of_arm(files[0] if files else None, masses, DRAWN))
    folder = make_folder(output or Path("shaper"))
    rated = rate_shapers(found.modes, tolerance)
    best, why = recommend(rated, tolerance)
    _show(found, rated, best, why)
    figure = _draw(found, rated, best)
    figure.savefig(folder / "shaper.png", dpi=130)
    (folder / "shaper.toml").write_text(snippet(found, best))
    _report(folder / "report.html", found, rated, best, why, figure)
    result = as_json(found, rated, best, why, tolerance)
    write_json(folder / "shaper.json", result)
    if json:
        write_json(json, result)
    console.print(f"wrote report.html, shaper.toml, shaper.json and shaper.png to {folder}/", markup=False)


def _from_recordings(paths: Sequence[Path], driven_by: str | None) -> Found:
    measured = measure_modes([read_recording(path) for path in paths], driven_by)
    top = 1.3 * max([3 * measured.modes[0].frequency, *(mode.frequency for mode in measured.modes)])
    frequencies = np.linspace(0.0, top, DRAWN)
    spectrum = np.zeros(DRAWN)
    if any(len(stretch.inputs) for stretch in measured.stretches):
        # peaks of a driven motion may be those of its input: what a step would ring with instead
        for mode in measured.modes:
            pole = (
                2 * np.pi * mode.frequency * (-mode.damping_ratio + 1j * np.sqrt(1 - mode.damping_ratio**2))
            )
            spectrum = np.hypot(spectrum, mode.size / np.abs(2j * np.pi * frequencies - pole))
        return Found(_names(paths), measured.modes, frequencies, spectrum, measured.warnings, measured.used)
    for stretch in measured.stretches:
        f, density = spectrum_of(stretch.outputs, stretch.step)
        spectrum = np.maximum(spectrum, np.interp(frequencies, f, np.sqrt(density), right=0.0))
    return Found(_names(paths), measured.modes, frequencies, spectrum, measured.warnings, measured.used)


def _names(paths: Sequence[Path]) -> str:
    return ", ".join(path.name for path in paths)


def mode_table(found: Found) -> Table:
    """One row a mode."""
    table = Table("What rings", ["mode", "frequency [Hz]", "spread [Hz]", "damping ratio", "spread", "share"])
    for i, mode in enumerate(found.modes, 1):
        table.rows.append(
            [
                str(i),
                _with_std(mode.frequency, mode.frequency_std),
                " to ".join(number(f, 4) for f in mode.frequency_range),
                _with_std(mode.damping_ratio, mode.damping_std),
                " to ".join(number(z, 2) for z in mode.damping_range),
                f"{100 * min(mode.size, 1.0):.0f} %",
            ]
        )
    return table


def shaper_table(found: Found, rated: Sequence[Rated], best: Rated) -> Table:
    """One row a shaper, by added time."""
    modes = [f"of mode {i} [%]" for i in range(1, len(found.modes) + 1)] if len(found.modes) > 1 else []
    columns = ["shaper", "impulses", "added time [ms]", "vibration left [%]", *modes]
    table = Table("Shapers, by the time they add", columns, best=best.name)
    for each in rated:
        left = [number(100 * v, 2) for v in each.by_mode] if modes else []
        count = str(int(jnp.sum(jnp.abs(each.shaper.amplitudes) > 1e-9)))
        table.rows.append(
            [each.name, count, number(1e3 * each.added_time, 3), number(100 * each.worst, 2), *left]
        )
    return table


def calls_table(rated: Sequence[Rated], best: Rated) -> Table:
    """The line of Python that makes each shaper."""
    rows: list[Sequence[str]] = [(each.name, each.call) for each in rated]
    return Table(
        "Settings: in Python, after import controllers as ctl", ["shaper", "call"], rows, best.name, 2
    )


def _with_std(value: float, std: float) -> str:
    if not std > 0:
        return number(value, 4)
    digits = max(0, 1 - int(np.floor(np.log10(std))))
    return f"{value:.{min(digits, 6)}f} ± {std:.{min(digits, 6)}f}"


def _show(found: Found, rated: Sequence[Rated], best: Rated, why: str) -> None:
    console.print(f"[bold]{found.title}[/]")
    for line in found.used:
        console.print(f"  {line}", markup=False, style="dim")
    for table in (mode_table(found), shaper_table(found, rated, best), calls_table(rated, best)):
        console.print()
        console.print(table.rich())
    console.print()
    console.print(f"Take {best.name}: {why}", style="bold", markup=False)
    console.print(f"  shaper = {best.call}", markup=False)
    for warning in found.warnings:
        console.print(f"Note: {warning}", markup=False)


def _draw(found: Found, rated: Sequence[Rated], best: Rated):
    zeta = min(found.modes[0].damping_ratio, 0.9)
    at = jnp.maximum(jnp.asarray(found.frequencies), 1e-9)
    curves = {each.name: np.asarray(residual_curve(each.shaper, at, zeta)) for each in rated}
    bands = [mode.frequency_range for mode in found.modes]
    return plot_shapers(found.frequencies, found.spectrum, bands, curves, best.name, _front(rated))


def _front(rated: Sequence[Rated]) -> list[str]:
    """Shapers of positive impulses that no shorter one betters, ZV first; the rest are drawn in grey."""
    front, least = [], np.inf
    for each in rated:
        if each.name not in ALTERNATING and each.worst < least:
            front.append(each.name)
            least = each.worst
    return front


def snippet(found: Found, best: Rated) -> str:
    """The shaper as a TOML table that `controllers.load_shaper` reads back."""
    mode = found.modes[0]
    lines = [
        f"# {best.name} for {found.title}, by jaxflex shaper. In Python, either of",
        '#   shaper = ctl.load_shaper("shaper.toml")',
        f"#   shaper = {best.call}",
        "[shaper]",
        f'name = "{best.name}"',
        f"frequency = {mode.frequency!r}  # Hz",
        f"damping_ratio = {mode.damping_ratio!r}",
        f"amplitudes = {best.shaper.amplitudes.tolist()!r}",
        f"delays = {best.shaper.delays.tolist()!r}  # s",
    ]
    return "\n".join(lines) + "\n"


def _report(path: Path, found: Found, rated: Sequence[Rated], best: Rated, why: str, figure) -> None:
    sections = [
        card("#2a6f97", paragraph(f"Take {best.name}."), paragraph(why[0].upper() + why[1:])),
        picture(png(figure, dpi=180), "What rings, and what each shaper leaves of it"),
        tables([mode_table(found), shaper_table(found, rated, best)]),
        paragraph(EXPLAINED),
        section(
            "To paste", f"<pre>{html.escape(snippet(found, best))}</pre>", tables([calls_table(rated, best)])
        ),
        section("The data", bullets([*found.used, *(found.warnings or ("Nothing looked wrong.",))])),
    ]
    write_report(path, f"Shaper for {found.title}", sections)


def as_json(found: Found, rated: Sequence[Rated], best: Rated, why: str, tolerance: float) -> dict:
    """The result for scripts."""
    return {
        "modes": [
            {
                "frequency_hz": mode.frequency,
                "frequency_std_hz": mode.frequency_std,
                "frequency_range_hz": list(mode.frequency_range),
                "damping_ratio": mode.damping_ratio,
                "damping_ratio_std": mode.damping_std,
                "damping_ratio_range": list(mode.damping_range),
                "size": mode.size,
            }
            for mode in found.modes
        ],
        "shapers": {
            each.name: {
                "amplitudes": each.shaper.amplitudes.tolist(),
                "delays_s": each.shaper.delays.tolist(),
                "added_time_s": each.added_time,
                "worst_residual": each.worst,
                "worst_residual_by_mode": list(each.by_mode),
                "python": each.call,
            }
            for each in rated
        },
        "recommended": best.name,
        "reason": why,
        "tolerance": tolerance,
        "warnings": list(found.warnings),
    }
