"""A vector of parameters with an effect in it, or without; and which effects hold others as a part."""

import dataclasses

import numpy as np

from .catalogue import Candidate
from .parameters import Parameters


def adopt(
    parameters: Parameters, vector: np.ndarray, candidate: Candidate, step: tuple[float, ...]
) -> np.ndarray:
    """`vector` with the candidate in it, its amplitudes at `step`."""
    vector = vector.copy()
    for name, value in candidate.shape:
        vector[parameters.position(*candidate.key, name)] = value
    for name, value in zip(candidate.amplitudes, step, strict=False):
        vector[parameters.position(*candidate.key, name)] = value
    if candidate.effect == "cable_stiffness" and len(step) > 1:
        vector[parameters.position(*candidate.key, "rest_angle")] = step[1] / step[0]
    return vector


def amplitudes_of(parameters: Parameters, vector: np.ndarray, candidate: Candidate) -> tuple[float, ...]:
    """The step by which `adopt` makes a candidate as large as it is in `vector`."""
    found = [float(vector[parameters.position(*candidate.key, name)]) for name in candidate.amplitudes]
    if candidate.effect == "cable_stiffness":
        found.append(found[0] * float(vector[parameters.position(*candidate.key, "rest_angle")]))
    return tuple(found)


def without(parameters: Parameters, vector: np.ndarray, effect: Candidate) -> np.ndarray:
    """`vector` with the effect absent again."""
    vector = vector.copy()
    for part in parameters.effect:
        if (part.effect, part.location) == effect.key:
            vector[parameters.position(*effect.key, part.field)] = part.value
    return vector


def held_by(candidate: Candidate) -> set[tuple[str, str]]:
    """The effects that this one holds as a part of its law, and takes the place of."""
    return {("coulomb_friction", candidate.location)} if candidate.effect == "stribeck_friction" else set()


def rise(candidate: Candidate) -> Candidate:
    """Stribeck's law without its level, which Coulomb's friction has already."""
    return dataclasses.replace(candidate, amplitudes=("torque",))


def risen(
    parameters: Parameters, vector: np.ndarray, candidate: Candidate, step: tuple[float, ...]
) -> tuple[Candidate, tuple[float, ...]]:
    """The whole of Stribeck's law where `step` is its rise above the Coulomb friction in `vector`."""
    level = float(vector[parameters.position("coulomb_friction", candidate.location, "torque")])
    return dataclasses.replace(candidate, amplitudes=("torque", "level")), (step[0], level)


def with_candidate(
    parameters: Parameters,
    effects: tuple[Candidate, ...],
    vector: np.ndarray,
    candidate: Candidate,
    step: tuple[float, ...],
) -> tuple[tuple[Candidate, ...], np.ndarray]:
    """Effects and vector with the candidate as well, its amplitudes at `step`, less what it holds itself."""
    held = [effect for effect in effects if effect.key in held_by(candidate)]
    for effect in held:
        vector = without(parameters, vector, effect)
    kept = tuple(effect for effect in effects if effect not in held)
    return (*kept, candidate), adopt(parameters, vector, candidate, step)
