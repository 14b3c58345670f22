"""A diagnosis in words: channels, places, effects, and numbers with their standard deviation."""

import math

from ..diagnosis.result import Diagnosis, Estimate, NamedEffect
from ..plotting import TITLES
from .tables import number

NAMES = {"coulomb": "Coulomb", "stribeck": "Stribeck"}
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

MEANING = {
    "nothing_missing": "On recordings that it was not calibrated on, the model with calibrated parameters "
    "errs by no more than the noise of the sensors. There is nothing left to explain.",
    "missing_effect": "No other effect in the catalogue explains these recordings as well.",
    "ambiguous": "Ambiguous means: something is missing for certain, and each of the effects named "
    "explains these recordings as well as the others do. The improved model holds the first; another "
    "experiment has to tell them apart.",
    "unexplained": "Unexplained means: the model and the data disagree by more than the noise, for "
    "certain, and no effect in the catalogue, nor several together, makes up for it. What is known of the "
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


def effect(name: str) -> str:
    """`coulomb_friction` as `Coulomb friction`."""
    return " ".join(NAMES.get(word, word) for word in name.split("_"))


def effect_at(found: NamedEffect) -> str:
    """An effect with its place."""
    return f"{effect(found.name)} at {place(found.location)}".replace("at the reading", "in the reading")


def estimate(value: Estimate) -> str:
    """Value and standard deviation to two digits of the latter, with the unit."""
    unit = "" if value.unit == "1" else f" {value.unit}"
    if not (math.isfinite(value.value) and math.isfinite(value.std)):
        return f"{number(value.value)} ± {number(value.std)}{unit}"
    if value.std <= 0:
        return f"{value.value:.4g}{unit} (held)"
    power = math.floor(math.log10(max(abs(value.value), value.std)))
    scale = 1.0 if -4 <= power < 4 else 10.0**power
    digits = min(max(0, 1 - math.floor(math.log10(value.std / scale))), 8)
    text = f"{value.value / scale:.{digits}f} ± {value.std / scale:.{digits}f}"
    return f"{text}{unit}" if scale == 1.0 else f"({text})×10{str(power).translate(SUPERSCRIPTS)}{unit}"


def parameters(found: NamedEffect) -> str:
    """Every parameter of an effect in one line."""
    return ", ".join(f"{key.replace('_', ' ')} {estimate(e)}" for key, e in found.parameters.items())


def share(value: float) -> str:
    """A share in per cent, never rounded up to all of it."""
    return "more than 99 %" if 0.99 < value < 1 else f"{100 * value:.0f} %"


def headline(found: Diagnosis) -> str:
    """The verdict in one sentence."""
    named = _listed([effect_at(e) for e in found.effects], "and")
    if found.verdict == "nothing_missing":
        return "Nothing is missing: the model predicts the measurements down to their noise."
    if found.verdict == "missing_effect":
        return f"The model lacks {named}."
    if found.verdict == "ambiguous":
        rivals = _listed([effect_at(e) for e in found.alternatives], "or")
        return f"The model lacks {named}; these recordings cannot tell it from {rivals}."
    at = f" It shows most in {equation(found.where[0].equation)}." if found.where else ""
    partly = f" {named[0].upper()}{named[1:]} explains a part of it." if named else ""
    return f"Something is missing that no effect in the catalogue explains.{at}{partly}"


def gap_closed(found: Diagnosis) -> str:
    """How much of the gap is gone, in one sentence; empty where nothing was missing."""
    if not found.effects:
        return ""
    return f"With it in the model, {share(found.explained)} of the gap on held-out data is gone."


def _listed(items: list[str], word: str) -> str:
    if len(items) < 2:
        return "".join(items)
    return f"{', '.join(items[:-1])} {word} {items[-1]}"
