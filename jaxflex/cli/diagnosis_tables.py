"""The tables of a diagnosis, for terminal and report alike."""

from collections.abc import Sequence

from ..diagnosis.parameters import Nominal, Parameters
from ..diagnosis.result import Diagnosis, Estimate, NamedEffect
from ..files.arm_file import ArmFile
from ..files.units import parameter_unit
from ..sensors import unit
from . import words
from .tables import Table, number

FAR = 3.0  # stated standard deviations that a parameter may move without a word


def effect_table(title: str, effects: Sequence[NamedEffect]) -> Table:
    """One row a parameter: the effect, its place, the parameter with its standard deviation, the evidence."""
    table = Table(title, ["effect", "where", "parameter", "value ± std", "evidence"], words=3)
    for effect in effects:
        first = (words.spoken(effect.name), words.place(effect.location), f"{effect.evidence:.3g}")
        for key, value in effect.parameters.items():
            name, at, evidence = first
            table.rows.append([name, at, words.spoken(key), words.estimate(value), evidence])
            first = ("", "", "")
    return table


def gap_table(found: Diagnosis) -> Table:
    """Error of every channel before and after, with its noise floor."""
    gap = found.gap
    data = "held-out data" if gap.held_out else "the data calibrated on"
    columns = ["channel", "unit", "before", "after", "noise floor", "before / floor", "after / floor"]
    table = Table(f"Error on {data}: {gap.metric}", columns, words=2)
    for name, floor in gap.noise_floor.items():
        before, after = gap.before[name], gap.after[name]
        figures = [number(v) if v >= 1e-3 else f"{v:.2e}" for v in (before, after, floor)]
        ratios = [number(v / floor) if floor > 0 else "–" for v in (before, after)]
        table.rows.append([words.channel(name), words.unit(unit(name)), *figures, *ratios])
    return table


def where_table(found: Diagnosis) -> Table:
    """Where the disagreement shows, acts, and what it goes with."""
    table = Table(
        "Errors above the noise: which channels show them, what they act through and go with",
        ["shows in", "share of the gap", "acts in", "goes with"],
        words=4,
    )
    for spot in found.where:
        table.rows.append(
            [words.channel(spot.channel), words.share(spot.share), words.equation(spot.equation), spot.regime]
        )
    return table


def calibrated_table(found: Diagnosis, file: ArmFile) -> Table:
    """Every nominal parameter: the file's value, the calibrated one, and how far it moved."""
    columns = ["parameter", "unit", "in the file", "calibrated ± std", "moved", "moved / stated std"]
    table = Table("Nominal parameters, in the file and calibrated", columns, words=2)
    for part, value, moved in _moves(found, file):
        table.rows.append([
            words.spoken(part.name), words.unit(parameter_unit(part.name)), f"{part.value:.4g}",
            words.estimate(Estimate(value.value, value.std, "1")), f"{100 * moved:+.1f} %",
            f"{moved / part.spread:+.1f}",
        ])  # fmt: skip
    return table


def far_moved(found: Diagnosis, file: ArmFile) -> str:
    """A warning that names the parameters that left the file's uncertainty; empty where none did."""
    far = [
        f"{words.spoken(part.name)} ({moved / part.spread:+.1f})"
        for part, _, moved in _moves(found, file)
        if abs(moved) > FAR * part.spread
    ]
    if not far:
        return ""
    return (
        f"Moved by more than {FAR:g} stated standard deviations: {', '.join(far)}. Either the file is wrong "
        "there, or the parameter makes up for something that was not named."
    )


def _moves(found: Diagnosis, file: ArmFile) -> list[tuple[Nominal, Estimate, float]]:
    """Every calibrated parameter with its estimate and its relative move from the file's value."""
    values = found.calibrated
    known = [part for part in Parameters(file, ()).nominal if part.name in values]
    return [(part, values[part.name], values[part.name].value / part.value - 1) for part in known]
