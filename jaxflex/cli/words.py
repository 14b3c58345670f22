"""A diagnosis in words: channels, places, effects, and numbers with their standard deviation."""

import math

from ..diagnosis.result import Diagnosis, Estimate, NamedEffect
from ..plotting import TITLES
from .tables import number

NAMES = {"coulomb": "Coulomb", "stribeck": "Stribeck", "youngs": "Young's", "emf": "EMF"}
POWERS = {"^2": "²", "^3": "³"}
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

MEANING = {
    "nothing_missing": "On recordings that it was not calibrated on, the model with calibrated parameters "
    "errs by no more than the noise of the sensors. There is nothing left to explain.",
    "missing_effect": "No other effect in the catalogue explains these recordings as well.",
    "ambiguous": "Ambiguous means: something is missing for certain, and each of the effects named "
    "explains these recordings as well as the others do. The improved model holds the first; another "
    "experiment has to tell them apart.",
    "unexplained": "Unexplained means: the model and the data disagree by more than the noise, for "
    "certain, and no effect in the catalogue, nor several together, makes up for it, unless parameters of "
    "the arm itself leave their stated uncertainty by far. What is known of the "
    "disagreement is where it is and what it goes with. Do not trust the improved model beyond these "
    "recordings.",
}


def channel(name: str) -> str:
    """`tip_deflection_1` as `tip deflection 1`."""
    if name in TITLES:
        return TITLES[name]
    kind, _, count = name.rpartition("_")
    return f"{TITLES[kind]} {count}" if kind in TITLES else name.replace("_", " ")


def place(location: str) -> str:
    """Where an effect acts: `joint 1`, `the tip`, `the reading of tip deflection 1`."""
    if location in ("tip", "base"):
        return f"the {location}"
    if location.startswith(("joint_", "link_")):
        return location.replace("_", " ")
    return f"the reading of {channel(location)}"


def equation(name: str) -> str:
    """What an equation balances: `the torques on joint 1`."""
    if name.startswith("sensor "):
        return f"the sensor of {channel(name.removeprefix('sensor '))}"
    kind, _, count = name.rpartition("_")
    balance = {
        "joint": "the torques on joint",
        "voltage": "the voltages of motor",
        "link": "the forces on link",
    }
    return f"{balance[kind]} {count}" if kind in balance else name


def spoken(name: str) -> str:
    """`coulomb_friction` as `Coulomb friction`."""
    return " ".join(NAMES.get(word, word) for word in name.split("_"))


def effect_at(found: NamedEffect) -> str:
    """An effect with its place."""
    return f"{spoken(found.name)} at {place(found.location)}".replace("at the reading", "in the reading")


def unit(text: str) -> str:
    """`kg m^2` as `kg m²`."""
    for plain, raised in POWERS.items():
        text = text.replace(plain, raised)
    return text


def estimate(value: Estimate) -> str:
    """Value and standard deviation to two digits of the latter, with the unit."""
    tail = "" if value.unit == "1" else f" {unit(value.unit)}"
    if not (math.isfinite(value.value) and math.isfinite(value.std)):
        return f"{number(value.value)} ± {number(value.std)}{tail}"
    if value.std <= 0:
        return f"{value.value:.4g}{tail} (held)"
    power = math.floor(math.log10(max(abs(value.value), value.std)))
    scale = 1.0 if -4 <= power < 4 else 10.0**power
    digits = min(max(0, 1 - math.floor(math.log10(value.std / scale))), 8)
    text = f"{value.value / scale:.{digits}f} ± {value.std / scale:.{digits}f}"
    return f"{text}{tail}" if scale == 1.0 else f"({text})×10{str(power).translate(SUPERSCRIPTS)}{tail}"


def parameters(found: NamedEffect) -> str:
    """Every parameter of an effect in one line."""
    return ", ".join(f"{spoken(key)} {estimate(e)}" for key, e in found.parameters.items())


def share(value: float) -> str:
    """A share in per cent, never rounded up to all of it."""
    return "more than 99 %" if 0.99 < value < 1 else f"{100 * value:.0f} %"


def answer(found: Diagnosis) -> list[str]:
    """The verdict in sentences: what it is, its size, the gap that is left, what the verdict means."""
    sentences = [_headline(found), _size(found), _gap(found), MEANING[found.verdict]]
    return [sentence for sentence in sentences if sentence]


def _headline(found: Diagnosis) -> str:
    named = _listed([effect_at(e) for e in found.effects], "and")
    rivals = _listed([effect_at(e) for e in found.alternatives], "or")
    if found.verdict == "nothing_missing":
        return "Nothing is missing: the model predicts the measurements down to their noise."
    if found.verdict == "missing_effect":
        return f"The model lacks {named}."
    if found.verdict == "unexplained":
        return "Something is missing that no effect in the catalogue explains."
    if len(found.effects) == 1:
        return f"The model lacks {named}, or else {rivals}: these recordings cannot tell which."
    return f"The model lacks {named}; in place of one of them, {rivals} explains these recordings as well."


def _size(found: Diagnosis) -> str:
    if found.verdict == "unexplained":
        at = f"It shows most in {equation(found.where[0].equation)}." if found.where else ""
        named = [effect_at(e) for e in found.effects]
        part = f" A part of it is explained by {_listed(named, 'and')}." if named else ""
        return at + part
    many = len(found.effects) > 1
    sizes = [f"{spoken(e.name)}, {parameters(e)}" if many else parameters(e) for e in found.effects]
    return f"Size: {'; '.join(sizes)}." if sizes else ""


def _gap(found: Diagnosis) -> str:
    floor = found.gap.noise_floor
    ratios = {n: (found.gap.before[n] / f, found.gap.after[n] / f) for n, f in floor.items() if f > 0}
    if not ratios:
        return ""
    worst = max(ratios, key=lambda name: ratios[name][0])
    before, after = (number(ratio, 2) for ratio in ratios[worst])
    data = "held-out data" if found.gap.held_out else "the data it was calibrated on"
    if not found.effects:
        return f"The model's error on {data} is at most {before} times the noise floor, in {channel(worst)}."
    added = "what was added" if found.verdict == "unexplained" or len(found.effects) > 1 else "it"
    return (
        f"With {added} in the model, {share(found.explained)} of the gap on {data} is gone: the error of "
        f"{channel(worst)} goes from {before} to {after} times the noise floor."
    )


def _listed(items: list[str], word: str) -> str:
    if len(items) < 2:
        return "".join(items)
    return f"{', '.join(items[:-1])} {word} {items[-1]}"
