"""Turn what a search came to into an answer: verdict, figures on held-out data, and words."""

# arrays of numpy go to JAX and come back, which its annotations do not foresee
# pyright: reportArgumentType=false, reportOptionalMemberAccess=false

import dataclasses
import time

import jax.numpy as jnp
import numpy as np

from ..arm.arm import Arm
from ..effects import EFFECTS, AbstractDryFriction, LoadTorqueBias
from ..effects.base import AbstractSensorEffect
from .adopt import without
from .catalogue import RIGID_SIGN, SIGN, Candidate
from .departure import departures, is_bent
from .estimates import estimated
from .find import MOST_EFFECTS
from .foretell import AT_FLOOR, Foretold, foretell
from .hypothesis import CLOSE, Hypothesis, Search
from .locate import LatentForce, regimes
from .loose_joint import is_of_loose_joint
from .next_experiment import advice
from .outcome import Outcome
from .parameters import BRISTLE, Parameters
from .result import Comparison, Diagnosis, Estimate, Gap, NamedEffect, Place
from .shooting import Problem
from .study import Study

RIGID = 0.25  # of what a bristle is begun with: up to there it is as good as none
VISIBLE = 1.1  # misfit a reading from which there is a gap to speak of
MOSTLY = 0.9  # share of the gap that a named effect must explain where the floor is not reached
TOGETHER = 0.98  # the same, of several, which may imitate what is in no catalogue
BY_DIRECTION = (AbstractDryFriction, LoadTorqueBias)  # what a joint feels by the direction it turns in alone


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
    final = study.everything()
    estimates = estimated(search, final)
    effects = tuple(
        _named(search, final, effect, gain, estimates)
        for effect, gain in zip(outcome.final.effects, outcome.gains, strict=True)
    )
    alternatives = []
    for place, rival in outcome.rivals:
        candidate = rival.effects[-1]
        alternatives.append(_named(search, rival, candidate, outcome.gains[place], estimated(search, rival)))
    bent = is_bent(parameters, final, outcome.explained)
    verdict = "unexplained" if bent else _verdict(outcome, after.level, gone)
    return Diagnosis(
        verdict=verdict,
        effects=effects,
        alternatives=tuple(alternatives),
        where=_where(before.misfits, forces_before, outcome),
        gap=Gap(
            _measure(before, after),
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


def _measure(before: Foretold, after: Foretold) -> str:
    """What a gap is measured by."""
    shorter = f" ({after.span:.2g} s after)" if after.span < before.span else ""
    return f"root mean square error of predictions over {before.span:.2g} s{shorter} from estimated starts"


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


def _verdict(outcome: Outcome, left: float, gone: float) -> str:
    """What was found, by what is left and the share that has gone; effects enough to imitate anything name nothing."""
    if not outcome.final.effects:
        return "nothing_missing" if left < AT_FLOOR else "unexplained"
    one = laws(outcome.final.effects) == 1
    most = len(outcome.final.effects) == MOST_EFFECTS
    if left > AT_FLOOR and (gone < (MOSTLY if one else TOGETHER) or most):
        return "unexplained"
    return "ambiguous" if outcome.rivals else "missing_effect"


def laws(effects: tuple[Candidate, ...]) -> int:
    """How many effects, those that one joint feels by its direction alone counted once.

    Friction, its asymmetry and a constant torque are two torques, one for either direction.
    """
    return len({e.location if issubclass(EFFECTS[e.effect], BY_DIRECTION) else e.key for e in effects})


def _bent(search: Search, final: Hypothesis) -> str:
    farthest = sorted(departures(search.parameters, final).items(), key=lambda item: -abs(item[1]))[:3]
    worst = ", ".join(f"{name} {moved:+.1f}" for name, moved in farthest)
    return (
        f"the arm's own parameters had to leave their stated uncertainty to fit ({worst} standard deviations): "
        "what is missing is not what was named, or the uncertainty is larger than stated"
    )


def _named(
    search: Search, hypothesis: Hypothesis, effect: Candidate, gain: float, estimates: dict[int, Estimate]
) -> NamedEffect:
    found = {}
    parameters = search.parameters
    bends = bends_before_it_slides(parameters, hypothesis.fit.vector, effect)
    for name in (*effect.amplitudes, *effect.free):
        if name not in BRISTLE or bends:
            found[name] = estimates[parameters.position(*effect.key, name)]
    for name, value in effect.shape:
        if name not in found and name not in BRISTLE:
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
    """True of a dry friction with a bristle too long to be as good as none."""
    if "presliding" not in effect.free:
        return False
    place = parameters.position(*effect.key, "presliding")
    return bool(vector[place] > RIGID * parameters.start[place])


def _improved(study: Study, vector: np.ndarray) -> Arm:
    """The calibrated arm with the effects that were found, and no absent ones."""
    parameters, nominal = study.search.parameters, study.file.arm
    arm = parameters.build(jnp.asarray(vector))
    kept = list(nominal.effects)
    for effect in study.outcome.final.effects:
        kind = EFFECTS[effect.effect]
        values = {field: float(vector[parameters.position(*effect.key, field)]) for field in kind.units}
        if "presliding" in values and not bends_before_it_slides(parameters, vector, effect):
            values |= {
                "presliding": None,
                "bristle_damping": 0.0,
                "transition_rate": values["transition_rate"] * RIGID_SIGN / SIGN,
            }
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
