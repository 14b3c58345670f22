"""The search: effects are added one at a time until nothing in the catalogue stands out."""

import numpy as np

from ..effects import EFFECTS
from .departure import is_suspect, straightens
from .hypothesis import (
    CLOSE,
    FAIR,
    HORIZONS,
    LITTLE,
    PARTS,
    STRONG,
    Hypothesis,
    Ranked,
    Search,
    form_error,
)
from .outcome import Outcome
from .rivals import prune
from .runs import Starts
from .sift import NEAR, SHORT_LIST, sift
from .trial import Confirmed, Trial, adopted, followed, nearly_as_good, settled_at, straightened

MOST_EFFECTS = 5
FURTHER = HORIZONS[1]  # over which parts of the arm are told apart, where the motion is followed so long
PAIR = 2  # of the short list that are tried two at a time
FAR = 10.0  # misfit a reading that bends all parameters, whatever is missing
HALFWAY = 0.5  # of such a misfit: what an effect that brings it lower has to be right about


def find(search: Search) -> Outcome:
    """Add effects one at a time until nothing in the catalogue stands out.

    The outcome waits to be `gone_on` with where a spring between motor and link leaves nothing but strained
    parameters: its joint may come apart, and parts of the arm would make up for what turns on the motor's side.
    """
    base, starts = settled_at(search, (), search.parameters.start)
    nominal = calibrated(search, base, starts, base.fit.vector)
    outcome = Outcome(*nominal, search.over_a_second(nominal[0]))
    return _added_to(search, outcome, base, starts, waits=True)


def gone_on(search: Search, outcome: Outcome) -> Outcome:
    """The outcome with what else stands out, if it waits."""
    if outcome.waiting is None:
        return outcome
    base, starts = outcome.waiting
    outcome.waiting = None
    return _added_to(search, outcome, base, starts)


def find_from(search: Search, first: Hypothesis, other: Outcome) -> Outcome:
    """Add effects to a first one that is settled already, the pieces starting where they are.

    `other`: what came of the arm as it was stated. What it left without any effect is what there was
    to explain. Of parts of the arm the likeliest alone are tried, over the shortest horizon.
    """
    outcome = Outcome(other.nominal, other.nominal_starts, other.nominal_level)
    starts = search.starts()
    _advance(search, outcome, first, starts, first.fit.vector)
    return _added_to(search, outcome, first, starts, parts=False)


def calibrated(
    search: Search, base: Hypothesis, starts: Starts, vector: np.ndarray
) -> tuple[Hypothesis, Starts]:
    """What `followed` gives, and word of it."""
    found, found_starts = followed(search, base, starts, vector)
    count, level = len(base.effects), found.fit.level
    search.say(f"calibrated with {count} effect(s): misfit {level:.3g} of the noise floor")
    return found, found_starts


def _advance(search: Search, outcome: Outcome, base: Hypothesis, starts: Starts, vector: np.ndarray) -> None:
    outcome.passed[outcome.final.effects] = outcome.final, outcome.final_starts
    outcome.final, outcome.final_starts = calibrated(search, base, starts, vector)
    outcome.level = search.over_a_second(outcome.final)


def _added_to(
    search: Search,
    outcome: Outcome,
    base: Hypothesis,
    starts: Starts,
    parts: bool = True,
    waits: bool = False,
) -> Outcome:
    """The outcome with what else stands out; its final hypothesis began at `base`."""
    while len(outcome.final.effects) < MOST_EFFECTS:
        if waits and awaits_a_loose_joint(search, outcome):
            outcome.waiting = base, starts
            return outcome
        found = next_effect(search, outcome, base, starts, parts)
        if found is None:
            break
        base, starts, vector = found
        _advance(search, outcome, base, starts, vector)
    search.restart(outcome.final_starts)
    before = outcome.final
    prune(search, outcome)
    if outcome.final is not before:
        outcome.level = search.over_a_second(outcome.final)
    return outcome


def next_effect(
    search: Search, outcome: Outcome, base: Hypothesis, base_starts: Starts, parts: bool
) -> tuple[Hypothesis, Starts, np.ndarray] | None:
    """What to add to the outcome's final hypothesis, which began at `base`; None if nothing stands out.

    A hypothesis to go on from, where its pieces start, and the parameters as fitted. `parts`: whether
    all changes of the arm's parts are tried where its parameters went too far, and not the likeliest alone.
    """
    fitted, starts, explained = outcome.final, outcome.final_starts, outcome.explained_over()
    suspect = is_suspect(search.parameters, fitted, outcome.explained)
    if leaves_little(outcome) and not suspect:
        return None
    search.restart(starts)
    ranked = search.rank(fitted.fit.vector, fitted.effects, tuple(h for h in HORIZONS if h <= fitted.horizon))
    far = fitted.fit.level > CLOSE and fitted.horizon == HORIZONS[0]
    if far:
        # a fit that the missing effect has bent is a poor place to judge from: the
        # parameters as they were before it are judged as well, over the shortest horizon
        search.restart(base_starts)
        ranked = _merge(search.rank(base.fit.vector, base.effects, (1,)), ranked)
    if not suspect:
        form = form_error(fitted.effects, explained)
        ranked = [item for item in ranked if item.gain > form[item.horizon]]
    tried = _short_list(ranked)
    # strain shows over any horizon, and where effects were found before, fits over longer ones take long
    horizon = HORIZONS[0] if suspect and not parts else HORIZONS[-1]
    trial = Trial(search, fitted, starts, explained, far, horizon)
    trial.confirm(tried, *((base, base_starts) if far else (fitted, starts)))
    if far and not any(entry.strength > STRONG for entry in trial.worthy):
        # parameters bent by two effects may leave less than either of them does alone
        for item in tried[:PAIR]:
            first, first_starts = adopted(search, base, base_starts, item)
            more = search.rank(first.fit.vector, first.effects, HORIZONS[:1])
            trial.confirm(_short_list(more)[:PAIR], first, first_starts)
    all_explained = trial.share * outcome.explained
    chosen = trial.simplest(trial.confirmed) if suspect and trial.confirmed else None
    if parts and suspect and not (chosen and decisive(search, trial.fitted, chosen.found)):
        changes = search.parts(base.effects)
        if chosen and is_enough(search, chosen.found, all_explained):
            changes = imitating(trial.search, chosen, changes)
        if changes:
            search.restart(base_starts)
            stated, stated_starts = straightened(search, base)
            likely = sift(search, stated, stated_starts, changes, min(fitted.horizon, FURTHER))
            trial.confirm(likely, stated, stated_starts)
    if not trial.worthy:
        return None
    chosen = trial.simplest(trial.worthy)
    best = chosen.found
    straight = suspect and straightens(search.parameters, trial.fitted, best, all_explained)
    if not (chosen.strength > STRONG or straight):
        return None
    outcome.close[best.effects[-1].key] = nearly_as_good(search, trial.fitted, best, trial.worthy)
    return *trial.base(chosen), best.fit.vector


def leaves_little(outcome: Outcome) -> bool:
    """True if effects were found that leave hardly any of the gap."""
    final = outcome.final
    little = outcome.level - 1 < LITTLE * (outcome.nominal_level - 1)
    return bool(final.effects) and final.closest < CLOSE and little


def awaits_a_loose_joint(search: Search, outcome: Outcome) -> bool:
    """True if a spring between motor and link leaves nothing but parameters that went too far."""
    springs = [effect for effect in outcome.final.effects if effect.effect == "joint_flexibility"]
    strained = leaves_little(outcome) and is_suspect(search.parameters, outcome.final, outcome.explained)
    return bool(springs) and strained


def decisive(search: Search, before: Hypothesis, best: Hypothesis) -> bool:
    """True if no part of the arm need be tried beside what was found best.

    Either nothing is left; or much is, which bends all parameters, and most of it has gone.
    """
    if issubclass(EFFECTS[best.effects[-1].effect], PARTS):
        return False  # another part of the arm could be meant
    if before.fit.level > FAR and best.fit.level < HALFWAY * before.fit.level:
        return True
    return is_enough(search, best)


def is_enough(search: Search, found: Hypothesis, explained: float = 0.0) -> bool:
    """True if nothing is left over the horizon of the fit, and no parameter went too far (`is_suspect`)."""
    return found.fit.level < FAIR and not is_suspect(search.parameters, found, explained)


def imitating(search: Search, confirmed: Confirmed, parts: list[Ranked]) -> list[Ranked]:
    """Of the parts of the arm those that could do nearly what the last effect of a hypothesis does.

    Where that effect is enough, parameters are bent so little that a test to first order says so.
    """
    found = confirmed.found
    search.restart(confirmed.starts)
    own = found.effects[-1]
    tried = [own, *dict.fromkeys(part.candidate for part in parts if part.candidate.key != own.key)]
    ranked = search.scored(found.fit.vector, found.effects, tried, (found.horizon,), instead=own)
    gains = {item.candidate.key: item.gain for item in ranked}
    least = NEAR * gains.get(own.key, 0.0)
    return [
        part
        for part in parts
        if part.candidate.key != own.key and gains.get(part.candidate.key, 0.0) >= least
    ]


def _merge(first: list[Ranked], second: list[Ranked]) -> list[Ranked]:
    """Both rankings, each candidate once, the first ranking's best before the second's."""
    best = {}
    for item in (*first, *second):
        key = item.candidate.key
        if key not in best or item.strength > best[key].strength:
            best[key] = item
    return sorted(best.values(), key=lambda item: -item.strength)


def _short_list(ranked: list[Ranked]) -> list[Ranked]:
    """The strongest, and those near the strongest of the others that stand out most at the same horizon."""
    strong = [item for item in ranked if item.strength > STRONG]
    most: dict[int, float] = {}
    for item in strong:
        most.setdefault(item.horizon, item.strength)
    return [item for item in strong if item.strength > NEAR * most[item.horizon]][:SHORT_LIST]
