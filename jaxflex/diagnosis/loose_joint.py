"""Joints whose motor and link may come apart: backlash, and springs that do not follow at once.

Such a joint has a coordinate more than the nominal one, and play leaves no trace in the slopes
about a motion without it. So they are tried on an arm of their own, from several sizes, when
nothing else explains what was measured.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from ..files.arm_file import ArmFile
from ..files.recording import Recording
from .adopt import adopt, amplitudes_of
from .calibrate import Freedom, fit
from .catalogue import Candidate
from .flanks import choose_flanks, press
from .hypothesis import CLOSE, HORIZONS, Hypothesis, Search, freedom
from .parameters import Parameters
from .study import Study

FLANKS = {  # of CONTACT: value, and relative uncertainty
    "contact_stiffness": (30.0, 1.5),  # N m/rad; a fit finds its way from soft flanks to hard ones, not back
    "contact_damping": (0.03, 1.5),  # N m s/rad
    "motor_share": (0.6, 0.3),
}
SPRING = {  # the same, of a joint whose flexibility is all there is: hard flanks without play
    "contact_stiffness": (1e3, 0.0),
    "contact_damping": (1e-3, 1.5),
    "motor_share": (0.6, 0.3),
}
COMPLIANCES = (0.05, 0.5)  # rad/(N m), to start from
GAPS = (0.005, 0.015, 0.045)  # rad; a fit finds its way from a third of the true one, and from three times
# rad; before a load that nothing shows a fit finds its way from half, and from twice
HIDDEN_GAPS = (0.002, 0.004, 0.008, 0.016, 0.032)
GONE = 1.1  # misfit a reading, in units of the noise, that leaves nothing
NEARLY = 0.05  # of the misfit beyond the noise: what the contact tried first may leave, that the other is not tried
LESS = 0.5  # of the same: what a loose joint may leave to be gone on with
TURNS = 3  # of trying the other flank and fitting again
HELPS = 0.9  # of the cost beyond the noise: a turn that leaves more has not helped
FIRST = 6  # iterations that tell sizes apart
LIKELY = 0.75  # of a misfit beyond the noise: what a loose joint, its contact as guessed, may leave


def loosened(file: ArmFile, joint: int, contact: dict[str, tuple[float, float]]) -> ArmFile:
    """The arm with motor and link of a joint apart, tied by this contact."""
    values = {name: value for name, (value, _) in contact.items()}
    joints = list(file.arm.joints)
    joints[joint] = dataclasses.replace(joints[joint], play=0.0, **values)
    arm = dataclasses.replace(file.arm, joints=tuple(joints))
    spread = {name: spread for name, (_, spread) in contact.items()}
    return dataclasses.replace(file, arm=arm, uncertainty=file.uncertainty | spread)


def loose_joints(other: Study, recordings: Sequence[Recording]) -> list[tuple[Study, Hypothesis]]:
    """For every joint play between motor and link or, if that leaves something, a spring where it fits better.

    The spring first where one is known. A part of the pieces says which, and whether it, along with the
    effects that `other` found, leaves far less than `other` does over the shortest horizon where that leaves
    something: else it is left out. Where nothing bends behind the joint, both are gone on with: starts that
    are free flatter a spring before a load that nothing shows.
    """
    found = []
    horizon, left = first_gap(other)
    most = max(1 + LESS * (left - 1), GONE)
    soft = _springs(other)
    for joint, own in enumerate(other.file.arm.joints):
        if soft and joint not in soft:
            continue  # another one is known to give way
        behind = other.file.arm.links[joint : joint + 1]
        if any(getattr(link, "model", "") == "lumped" for link in behind) or own.play is not None:
            continue
        bends = any(link.modes > 0 for link in behind)
        spring = Candidate("joint_flexibility", f"joint_{joint + 1}", ("compliance",))
        play = Candidate("backlash", f"joint_{joint + 1}", ("gap",))
        tried = []
        ways = [
            (FLANKS, play, GAPS if bends else HIDDEN_GAPS),
            (SPRING, spring, soft.get(joint, COMPLIANCES)),
        ]
        for contact, candidate, sizes in reversed(ways) if soft else ways:
            study = Study(
                loosened(other.file, joint, contact), recordings, other.held_out, other.search.say,
                carried=candidate is play,
            )  # fmt: skip
            # where in its play a load is that nothing shows, only the pieces before say
            few = study.search.thinned(horizon if bends or candidate is spring else HORIZONS[-1])
            beside = bool(other.outcome.final.effects)  # which bend the parameters until they are joined
            far = horizon == HORIZONS[0] and left > CLOSE
            limit = 1 + LIKELY * (left - 1) if bends and far and not beside else np.inf
            turns = 0 if bends and beside else TURNS
            fitted = best_from(few, candidate, sizes, limit, turns)
            other.search.say(f"tried {candidate.effect} at {candidate.location}: {fitted.fit.level:.3g}")
            told = joined(few, fitted, other, horizon)
            tried.append((study, fitted, told.fit.level if told.horizon == horizon else np.inf))
            if bends and tried[-1][2] < max(1 + NEARLY * (left - 1), GONE):
                break
        if bends:
            tried = [min(tried, key=lambda entry: entry[2])]
        found += [(study, in_full(study.search, fitted)) for study, fitted, level in tried if level < most]
    return found


def _springs(study: Study) -> dict[int, tuple[float, ...]]:
    """Compliances [rad/(N m)] of the springs, taken to follow at once, that were found between motor and link."""
    final = study.outcome.final
    return {
        effect.index: amplitudes_of(study.search.parameters, final.fit.vector, effect)
        for effect in final.effects
        if effect.effect == "joint_flexibility"
    }


def first_gap(study: Study) -> tuple[int, float]:
    """The shortest horizon over which what was found leaves something, and the misfit a reading there."""
    for horizon in HORIZONS:
        level = study.level_of_some(horizon)
        if level > GONE:
            return horizon, level
    return HORIZONS[0], 1.0


def joined(search: Search, loose: Hypothesis, other: Study, horizon: int) -> Hypothesis:
    """What a loose joint comes to along with the effects that `other` found for a joint that is not."""
    final, parameters = other.outcome.final, search.parameters
    others = tuple(effect for effect in final.effects if effect.key != loose.effects[0].key)
    vector = loose.fit.vector.copy()
    for effect in others:
        for name in (*effect.amplitudes, *(field for field, _ in effect.shape)):
            own = other.search.parameters.position(*effect.key, name)
            vector[parameters.position(*effect.key, name)] = final.fit.vector[own]
    if not others and horizon == HORIZONS[0]:
        return loose
    return search.climb((*loose.effects, *others), vector, to=horizon)


def best_from(
    search: Search,
    candidate: Candidate,
    sizes: Sequence[float],
    most: float = np.inf,
    turns: int = TURNS,
) -> Hypothesis:
    """The candidate fitted from the best of some sizes: with its contact as guessed, then with everything.

    From the parameters as stated: a misfit that a loose joint leaves bends them. Where the best leaves a
    misfit above `most` with its contact as guessed, it is left at that. `turns` as for `turned`.
    """
    stated = search.parameters.start
    search.settle(stated)
    starts = search.starts()
    first = without_contact(search.parameters, candidate)
    begun = []
    for size in sizes:
        search.restart(starts)
        with_it = adopt(search.parameters, stated, candidate, (size,))
        _settle(search, candidate, with_it)
        begun.append((fit(search.problem, search.runs, with_it, first, 1, most=FIRST), search.starts()))
    best, starts = min(begun, key=lambda entry: entry[0].cost)
    search.restart(starts)
    if best.level > most:
        return Hypothesis((candidate,), best, HORIZONS[0], {HORIZONS[0]: best.cost})
    return _climb(search, candidate, best.vector, turns)


def in_full(search: Search, fitted: Hypothesis) -> Hypothesis:
    """What was fitted to a part of the pieces, fitted to all of them."""
    (candidate,) = fitted.effects
    search.settle(search.parameters.start)
    _settle(search, candidate, fitted.fit.vector)
    if candidate.effect == "backlash":
        choose_flanks(search.problem, search.runs, fitted.fit.vector, candidate.index)
    return _climb(search, candidate, fitted.fit.vector)


def _settle(search: Search, candidate: Candidate, vector: np.ndarray) -> None:
    if candidate.effect == "backlash":
        press(search.problem, search.runs, vector, candidate.index)
    search.settle(vector)


def _climb(search: Search, candidate: Candidate, vector: np.ndarray, turns: int = TURNS) -> Hypothesis:
    fitted = search.climb((candidate,), vector, to=1, iterations=8)
    return turned(search, fitted, candidate.index, turns) if candidate.effect == "backlash" else fitted


def is_of_loose_joint(parameters: Parameters, effect: Candidate) -> bool:
    """True of what the arm of these parameters was taken apart for."""
    if effect.effect not in ("backlash", "joint_flexibility"):
        return False
    return parameters.arm.joints[effect.index].play is not None


def without_contact(parameters: Parameters, candidate: Candidate) -> Freedom:
    """Leave to move everything but the contact."""
    free = freedom(parameters, (candidate,))
    nominal = parameters.nominal
    own = [
        k
        for k, column in enumerate(free.columns)
        if column >= len(nominal) or not nominal[column].is_of_contact
    ]
    return Freedom(
        tuple(free.columns[k] for k in own),
        *(part[own] for part in (free.precision, free.centre, free.lowest, free.far)),
    )


def turned(search: Search, fitted: Hypothesis, joint: int, turns: int) -> Hypothesis:
    """Fitted again with the pieces that are lost begun at the flank that suits them, `turns` times while that helps."""
    for _ in range(turns):
        if fitted.fit.level < GONE:
            break
        starts = search.starts()
        choose_flanks(search.problem, search.runs, fitted.fit.vector, joint)
        again = search.climb(fitted.effects, fitted.fit.vector, to=1, iterations=8)
        noise = fitted.fit.count
        if not again.fit.cost - noise < HELPS * (fitted.fit.cost - noise):
            search.restart(starts)
            break
        fitted = again
    return fitted
