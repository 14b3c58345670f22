"""Turn what a search came to into an answer: verdict, figures on held-out data, and words."""

# arrays of numpy go to JAX and come back, which its annotations do not foresee
# pyright: reportArgumentType=false, reportOptionalMemberAccess=false

import dataclasses
import time

import jax.numpy as jnp
import numpy as np

from ..arm.arm import Arm
from ..effects import EFFECTS
from ..effects.base import AbstractSensorEffect
from ..files.units import parameter_unit
from ..sensors import unit
from .adopt import without
from .calibrate import fit
from .catalogue import RIGID_SIGN, SIGN, Candidate
from .departure import departures, is_bent
from .foretell import AT_FLOOR, Foretold, foretell
from .hypothesis import CLOSE, HORIZONS, Hypothesis, Outcome, Search, freedom, restart
from .locate import LatentForce, regimes
from .loose_joint import is_of_loose_joint
from .next_experiment import advice
from .parameters import EffectParameter, Parameters
from .result import Comparison, Diagnosis, Estimate, Gap, NamedEffect, Place
from .shooting import Problem
from .study import Study

VISIBLE = 1.1  # misfit a reading from which there is a gap to speak of
MOSTLY = 0.9  # share of the gap that named effects must explain where the floor is not reached
OWN_ERROR = 0.03  # of an effect's size: what the form given to it may be wrong by
OWN_ERRORS = {"stribeck_friction": 0.2, "winding_heating": 0.15}  # where many forms are in use
PRESLIDING_ERROR = 0.3  # the same, of how far a bristle bends: none of its laws is the true one
COMPONENTS = {"along_y": "along_x", "along_x": "along_y", "sine": "cosine", "cosine": "sine"}  # of one size
TIMING_ERRORS = {  # of a sample
    "input_delay": 0.05,  # a delayed command counts as its mean over each
    "sensor_lag": 0.3,  # a filter that works on samples lags by half of one more or less
}


def nominally(study: Study) -> Foretold:
    """The held-out runs as the calibrated arm without any effect foretells them."""
    study.search.restart(study.outcome.nominal_starts)
    return foretell(study.prepared.problem, study.prepared.held_out, study.outcome.nominal)


def describe(study: Study, first: Study, began: float) -> Diagnosis:
    """The diagnosis that an outcome amounts to; `first`: of the arm as it was stated, which may be another."""
    search, outcome, parameters = study.search, study.outcome, study.search.parameters
    before, after = nominally(first), study.foretold()
    # without what it does at its flanks, a joint that comes apart is pressed as hard as it was open
    apart = any(is_of_loose_joint(parameters, effect) for effect in outcome.final.effects)
    located = first if apart else study
    forces_before = lacking(located.search, located.outcome)
    search.restart(outcome.final_starts)
    forces_after = search.latent(outcome.final.fit.vector, outcome.final.horizon)
    gone = (before.level - after.level) / (before.level - 1) if before.level > VISIBLE else 0.0
    final = everything(study)
    estimates = _estimates(search, final)
    effects = tuple(
        _named(search, final, effect, gain, estimates)
        for effect, gain in zip(outcome.final.effects, outcome.gains, strict=True)
    )
    alternatives = []
    for place, rival in outcome.rivals:
        candidate = rival.effects[-1]
        alternatives.append(_named(search, rival, candidate, outcome.gains[place], _estimates(search, rival)))
    bent = is_bent(parameters, final, outcome.explained)
    verdict = "unexplained" if bent else _verdict(outcome, after.level, gone)
    return Diagnosis(
        verdict=verdict,
        effects=effects,
        alternatives=tuple(alternatives),
        where=_where(before.misfits, forces_before, outcome),
        gap=Gap(
            "root mean square error of predictions over 1 s from estimated starts",
            True, before.errors, after.errors, study.prepared.floor,
        ),
        next_experiment=_next(verdict, search, outcome, forces_after),
        calibrated={part.name: estimates[i] for i, part in enumerate(parameters.nominal)},
        improved=_improved(study, final.fit.vector),
        explained=float(np.clip(gone, 0.0, 1.0)),
        notes=(*study.notes, *([_bent(search, final)] if bent else [])),
        seconds=time.perf_counter() - began,
        forces_before=tuple(forces_before),
        forces_after=tuple(forces_after),
        comparison=_comparison(search.problem, before, after),
    )  # fmt: skip


def lacking(search: Search, outcome: Outcome) -> list[LatentForce]:
    """The forces that stand for what was found, the likeliest first.

    Those that the calibrated arm lacks without it, along the motion that it explains. Where nothing was
    found and much is left, the parameters are those stated: calibrated ones are bent by what is missing.
    """
    final, vector = outcome.final, outcome.final.fit.vector
    search.restart(outcome.final_starts)
    for effect in final.effects:
        vector = without(search.parameters, vector, effect)
    if not final.effects and final.fit.level > CLOSE:
        vector = search.parameters.start
        search.settle(vector)
    return search.latent(vector, final.horizon)


def everything(study: Study) -> Hypothesis:
    """The final hypothesis fitted to all runs, held-out ones too, for the best parameters."""
    prepared, search, final = study.prepared, study.search, study.outcome.final
    if any(effect.effect == "periodic_disturbance" for effect in final.effects):
        return final
    # the longest horizon over which the model still follows: beyond it, parameters would
    # be bent to make up for what it does not know
    followed = [h for h, cost in final.costs.items() if cost < CLOSE * final.fit.count]
    horizon = max(followed, default=HORIZONS[0])
    runs = [*prepared.calibration, *prepared.held_out]
    search.restart(study.outcome.final_starts)
    restart(prepared.held_out, study.foretold().starts)
    free = freedom(search.parameters, final.effects)
    found = fit(prepared.problem, runs, final.fit.vector, free, horizon, 3, fresh=True)
    if not found.level < max(CLOSE, 2 * final.fit.level) or not np.isfinite(found.normal.matrix).all():
        return final  # a run held out cannot be followed
    return Hypothesis(final.effects, found, horizon, {horizon: found.cost})


def _verdict(outcome: Outcome, left: float, gone: float) -> str:
    if not outcome.final.effects:
        return "nothing_missing" if left < AT_FLOOR else "unexplained"
    if left > AT_FLOOR and gone < MOSTLY:
        return "unexplained"
    return "ambiguous" if outcome.rivals else "missing_effect"


def _bent(search: Search, final: Hypothesis) -> str:
    farthest = sorted(departures(search.parameters, final).items(), key=lambda item: -abs(item[1]))[:3]
    worst = ", ".join(f"{name} {moved:+.1f}" for name, moved in farthest)
    return (
        f"the arm's own parameters had to leave their stated uncertainty to fit ({worst} standard deviations): "
        "what is missing is not what was named, or the uncertainty is larger than stated"
    )


def _estimates(search: Search, hypothesis: Hypothesis) -> dict[int, Estimate]:
    """Every parameter that was free, by its place in the vector."""
    found, parameters = hypothesis.fit, search.parameters
    matrix = found.normal.matrix + np.diag(found.freedom.prior(found.vector)[2])
    scale = np.sqrt(np.clip(np.diag(matrix), 1e-300, None))
    tidy = matrix / np.outer(scale, scale)
    spread = np.full(len(matrix), np.inf)  # of a motion that was lost nothing is known
    if np.isfinite(tidy).all():
        inverse = np.linalg.pinv(tidy) / np.outer(scale, scale)
        spread = np.sqrt(np.clip(np.diag(inverse), 0, None) * max(found.level, 1.0))
    estimates = {}
    for column, std in zip(found.freedom.columns, spread, strict=True):
        value = found.vector[column]
        if column < len(parameters.nominal):
            part = parameters.nominal[column]
            size = part.value * float(np.exp(part.spread * value))
            estimates[column] = Estimate(size, size * part.spread * float(std), parameter_unit(part.name))
        else:
            part = parameters.effect[column - len(parameters.nominal)]
            whole = float(np.hypot(std, own_error(search.problem, found.vector, part)))
            estimates[column] = Estimate(float(value), whole, _unit(part.unit, part.location))
    return estimates


def own_error(problem: Problem, vector: np.ndarray, part: EffectParameter) -> float:
    """What a parameter of an effect may be wrong by without noise, in its unit: form, timing, the reading's zero."""
    setting = problem.setting

    def value(field: str) -> float:
        return float(vector[setting.parameters.position(part.effect, part.location, field)])

    share = PRESLIDING_ERROR if part.field == "presliding" else OWN_ERRORS.get(part.effect, OWN_ERROR)
    own = share * np.hypot(
        value(part.field), value(COMPONENTS[part.field]) if part.field in COMPONENTS else 0.0
    )
    late = TIMING_ERRORS.get(part.effect, 0.0) * setting.sample_time
    angle = f"angle_{part.location.rpartition('_')[2]}"
    counted = part.field == "rest_angle" and angle in setting.channels
    off = setting.noise[setting.channels.index(angle)] if counted else 0.0
    return float(np.sqrt(own**2 + late**2 + off**2))


def _unit(text: str, location: str) -> str:
    if not text.startswith("of the channel"):
        return text
    own = unit(location)
    return own if text == "of the channel" else f"{own}/s"


def _named(
    search: Search, hypothesis: Hypothesis, effect: Candidate, gain: float, estimates: dict[int, Estimate]
) -> NamedEffect:
    found = {}
    parameters = search.parameters
    bends = bends_before_it_slides(parameters, hypothesis.fit.vector, effect)
    for name in (*effect.amplitudes, *effect.free):
        if name != "presliding" or bends:
            found[name] = estimates[parameters.position(*effect.key, name)]
    for name, value in effect.shape:
        if name not in found and name != "presliding":
            found[name] = Estimate(float(value), 0.0, EFFECTS[effect.effect].units[name])
    worth = float(gain) if np.isfinite(gain) else float(hypothesis.fit.count)
    return NamedEffect(effect.effect, effect.location, found, worth, EFFECTS[effect.effect].looks_like)


def _where(before: dict[str, float], forces: list[LatentForce], outcome: Outcome) -> tuple[Place, ...]:
    excess = {channel: max(misfit - 1, 0.0) for channel, misfit in before.items()}
    total = sum(excess.values())
    if total <= 0:
        return ()
    equation = forces[0].equation
    regime, _ = regimes(forces[0])[0]
    for effect in outcome.final.effects[:1]:
        if issubclass(EFFECTS[effect.effect], AbstractSensorEffect):
            equation, regime = f"sensor {effect.location}", EFFECTS[effect.effect].looks_like
    order = sorted(excess, key=lambda c: -excess[c])
    return tuple(Place(c, equation, regime, excess[c] / total) for c in order if excess[c] > 0.01 * total)


def _next(verdict: str, search: Search, outcome: Outcome, forces: list[LatentForce]) -> str:
    if verdict == "nothing_missing":
        return "None needed: the model predicts what was measured down to its noise."
    if verdict == "unexplained":
        picture, share = regimes(forces[0])[0]
        return (
            f"What is left acts most like a force at {forces[0].equation} that goes with {picture} "
            f"({share:.0%} of it). Repeat the run twice as large and at half the speed: what scales with "
            "the motion is in the arm, what does not is outside of it."
        )
    if outcome.rivals:
        place, rival = outcome.rivals[0]
        search.restart(outcome.final_starts)
        return advice(search, outcome.final, outcome.final.effects[place], rival.effects[-1])
    return "Repeat the run with another payload: the same effect with the same size confirms it."


def bends_before_it_slides(parameters: Parameters, vector: np.ndarray, effect: Candidate) -> bool:
    """True of a dry friction with a bristle longer than what it was begun with, which is as good as none."""
    if "presliding" not in effect.free:
        return False
    place = parameters.position(*effect.key, "presliding")
    return bool(vector[place] > parameters.start[place])


def _improved(study: Study, vector: np.ndarray) -> Arm:
    """The calibrated arm with the effects that were found, and no absent ones."""
    parameters, nominal = study.search.parameters, study.file.arm
    arm = parameters.build(jnp.asarray(vector))
    kept = list(nominal.effects)
    for effect in study.outcome.final.effects:
        kind = EFFECTS[effect.effect]
        values = {field: float(vector[parameters.position(*effect.key, field)]) for field in kind.units}
        if "presliding" in values and not bends_before_it_slides(parameters, vector, effect):
            values |= {"presliding": None, "transition_rate": values["transition_rate"] * RIGID_SIGN / SIGN}
        kept.append(kind(location=effect.location, **values))
    joints = []
    for own, given in zip(arm.joints, nominal.joints, strict=True):
        # a winding too fast for the samples is put back
        motor = own.motor
        if motor is not None and motor.inductance is None and given.motor.inductance is not None:
            motor = dataclasses.replace(motor, inductance=given.motor.inductance)
        joints.append(dataclasses.replace(own, motor=motor))
    return dataclasses.replace(arm, joints=tuple(joints), effects=tuple(kept))


def _comparison(problem: Problem, before: Foretold, after: Foretold) -> Comparison:
    run, first = before.predictions[0]
    _, second = after.predictions[0]
    count = len(run.times)

    def flat(values):
        return {name: values[..., i].ravel()[:count] for i, name in enumerate(problem.setting.channels)}

    return Comparison(run.times, flat(run.reading), flat(first), flat(second))
