"""What a diagnosis says: verdict, effects, where, how sure, and the gap before and after."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arm.arm import Arm
from .locate import LatentForce

VERDICTS = ("nothing_missing", "missing_effect", "ambiguous", "unexplained")


@dataclass(frozen=True)
class Estimate:
    """A parameter with its standard deviation and unit."""

    value: float
    std: float
    unit: str


@dataclass(frozen=True)
class NamedEffect:
    """An effect with its parameters, and its evidence: the fall of the misfit, in squared noise units."""

    name: str
    location: str
    parameters: dict[str, Estimate]
    evidence: float
    looks_like: str


@dataclass(frozen=True)
class Place:
    """Where the model and the data disagree: channel, equation, regime, and its share."""

    channel: str
    equation: str
    regime: str
    share: float


@dataclass(frozen=True)
class Gap:
    """Root mean square of the prediction error of each channel on held-out data, with the noise floor."""

    metric: str
    held_out: bool
    before: dict[str, float]
    after: dict[str, float]
    noise_floor: dict[str, float]


@dataclass(frozen=True)
class Comparison:
    """A held-out run, predicted before and after: readings and predictions by channel, for pictures."""

    times: np.ndarray
    measured: dict[str, np.ndarray]
    before: dict[str, np.ndarray]
    after: dict[str, np.ndarray]


@dataclass(frozen=True)
class Diagnosis:
    """The answer of `diagnose`.

    `verdict`: one of `nothing_missing`, `missing_effect`, `ambiguous`, `unexplained`;
    `effects` in the order added; `alternatives` not told apart from them; `improved`: the
    arm with calibrated parameters and the effects in it, to go on with; `forces_before`
    and `forces_after`: the force that would have to act for the model to be right.
    """

    verdict: str
    effects: tuple[NamedEffect, ...]
    alternatives: tuple[NamedEffect, ...]
    where: tuple[Place, ...]
    gap: Gap
    next_experiment: str
    calibrated: dict[str, Estimate]
    improved: Arm
    explained: float
    notes: tuple[str, ...]
    seconds: float
    forces_before: tuple[LatentForce, ...] = ()
    forces_after: tuple[LatentForce, ...] = ()
    comparison: Comparison | None = None

    def __repr__(self) -> str:
        named = ", ".join(f"{e.name} at {e.location}" for e in self.effects) or "no effect"
        return f"Diagnosis({self.verdict}: {named}; {self.explained:.0%} of the gap explained)"

    def to_json(self) -> dict[str, Any]:
        """The report as JSON: what `report.json` holds."""

        def estimate(e: Estimate) -> dict[str, Any]:
            return {"value": e.value, "std": e.std, "unit": e.unit}

        def effect(e: NamedEffect) -> dict[str, Any]:
            return {
                "name": e.name,
                "location": e.location,
                "parameters": {key: estimate(value) for key, value in e.parameters.items()},
                "evidence": e.evidence,
            }

        return {
            "verdict": self.verdict,
            "effects": [effect(e) for e in self.effects],
            "alternatives": [effect(e) for e in self.alternatives],
            "where": [vars(place) for place in self.where],
            "gap": vars(self.gap),
            "next_experiment": self.next_experiment,
            "calibrated": {key: estimate(value) for key, value in self.calibrated.items()},
            "explained": self.explained,
            "notes": list(self.notes),
            "seconds": self.seconds,
        }
