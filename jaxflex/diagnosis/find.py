"""The search: effects are added one at a time until nothing in the catalogue stands out."""

import dataclasses

import numpy as np

from ..effects import EFFECTS
from .adopt import amplitudes_of, held_by, with_candidate
from .catalogue import Candidate
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
    Starts,
    form_error,
)
from .outcome import Outcome
from .rivals import prune
from .sift import NEAR, SHORT_LIST, sift

MOST_EFFECTS = 5
FURTHER = HORIZONS[1]  # over which parts of the arm are told apart, where the motion is followed so long
PAIR = 2  # of the short list that are tried two at a time
SMALL = 0.3  # misfit a reading, beyond the noise floor, that leaves room for small effects
HALF = 0.3  # of a larger one that an effect has to explain
LEAD = 0.01  # of the gain: what a hypothesis with more parameters must be better by
FAR = 10.0  # misfit a reading that bends all parameters, whatever is missing
HALFWAY = 0.5  # of such a misfit: what an effect that brings it lower has to be right about

Confirmed = tuple[float, Hypothesis, Starts]  # strength, hypothesis, and where its pieces start


def find(search: Search) -> Outcome:
    """Add effects one at a time until nothing in the catalogue stands out."""
    base, starts = settled_at(search, (), search.parameters.start)
    nominal = calibrated(search, base, starts)
    outcome = Outcome(*nominal, search.over_a_second(nominal[0]))
    return _added_to(search, outcome, base, starts)


def find_from(search: Search, first: Hypothesis, other: Outcome) -> Outcome:
    """Add effects to a first one that is settled already, the pieces starting where they are.

    `other`: what came of the arm as it was stated. What it left without any effect is what there was
    to explain, and what parts of the arm imitate has been seen there.
    """
    outcome = Outcome(other.nominal, other.nominal_starts, other.nominal_level)
    starts = search.starts()
    _advance(search, outcome, first, starts)
    return _added_to(search, outcome, first, starts, parts=False)


def calibrated(search: Search, base: Hypothesis, starts: Starts) -> tuple[Hypothesis, Starts]:
    """The hypothesis fitted over as long as it follows, and where its pieces start."""
    search.restart(starts)
    fitted = search.climb(base.effects, base.fit.vector, ceiling=CLOSE)
    count, level = len(base.effects), fitted.fit.level
    search.say(f"calibrated with {count} effect(s): misfit {level:.3g} of the noise floor")
    return fitted, search.starts()


def _advance(search: Search, outcome: Outcome, base: Hypothesis, starts: Starts) -> None:
    outcome.passed[outcome.final.effects] = outcome.final, outcome.final_starts
    outcome.final, outcome.final_starts = calibrated(search, base, starts)
    outcome.level = search.over_a_second(outcome.final)


def _added_to(
    search: Search, outcome: Outcome, base: Hypothesis, starts: Starts, parts: bool = True
) -> Outcome:
    """The outcome with what else stands out; its final hypothesis began at `base`."""
    while len(outcome.final.effects) < MOST_EFFECTS:
        found = next_effect(search, outcome, base, starts, parts)
        if found is None:
            break
        base, starts = found
        _advance(search, outcome, base, starts)
    search.restart(outcome.final_starts)
    prune(search, outcome)
    return outcome


def next_effect(
    search: Search, outcome: Outcome, base: Hypothesis, base_starts: Starts, parts: bool
) -> tuple[Hypothesis, Starts] | None:
    """What to add to the outcome's final hypothesis, which began at `base`; None if nothing stands out.

    `parts`: whether changes of the arm's parts are tried where its parameters went too far.
    """
    fitted, starts, explained = outcome.final, outcome.final_starts, outcome.explained_over()
    suspect = parts and is_suspect(search.parameters, fitted, outcome.explained)
    little = outcome.level - 1 < LITTLE * (outcome.nominal_level - 1)
    if fitted.effects and fitted.closest < CLOSE and little and not suspect:
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
    before, before_starts = (base, base_starts) if far else (fitted, starts)
    confirmed: list[Confirmed] = []

    def confirm(items: list[Ranked], before: Hypothesis, before_starts: Starts) -> None:
        for item in items:
            found, found_starts = confirmed_from(
                search, before, before_starts, item, fitted.horizon, without=fitted
            )
            search.say(f"tried {item.candidate.effect} at {item.candidate.location}: {found.fit.level:.3g}")
            if search.sensible(found):
                confirmed.append((found.strength(fitted, explained), found, found_starts))

    confirm(tried, before, before_starts)
    if far and not any(strength > STRONG and _worth_it(fitted, found) for strength, found, _ in confirmed):
        # parameters bent by two effects may leave less than either of them does alone
        for item in tried[:PAIR]:
            first, first_starts = adopted(search, base, base_starts, item)
            more = search.rank(first.fit.vector, first.effects, HORIZONS[:1])
            confirm(_short_list(more)[:PAIR], first, first_starts)
    chosen = simplest(search, confirmed) if suspect and confirmed else None
    if suspect and not (chosen and decisive(search, fitted, chosen[1])):
        changes = search.parts(base.effects)
        if chosen and is_enough(search, chosen[1], outcome.explained):
            changes = imitating(search, chosen, changes)
        if changes:
            search.restart(base_starts)
            stated, stated_starts = straightened(search, base)
            likely = sift(search, stated, stated_starts, changes, min(fitted.horizon, FURTHER))
            confirm(likely, stated, stated_starts)
    confirmed = [entry for entry in confirmed if _worth_it(fitted, entry[1])]
    if not confirmed:
        return None
    strength, best, best_starts = simplest(search, confirmed)
    straight = suspect and straightens(search.parameters, fitted, best, outcome.explained)
    if not (strength > STRONG or straight):
        return None
    outcome.close[best.effects[-1].key] = nearly_as_good(search, fitted, best, confirmed)
    return best, best_starts


def confirmed_from(
    search: Search,
    before: Hypothesis,
    starts: Starts,
    item: Ranked,
    to: int,
    without: Hypothesis | None = None,
) -> tuple[Hypothesis, Starts]:
    """The candidate added to `before` in full, and where its pieces start; `without` as for `climb`.

    One that takes the place of another is fitted from the stated parameters as well: what the other
    bent them to is no good place to begin.
    """
    found, found_starts = search.confirm(before, starts, item, to, without=without), search.starts()
    takes_over = {effect.key for effect in before.effects} & held_by(item.candidate)
    if takes_over and min(before.fit.level, found.closest) > CLOSE:
        search.restart(starts)
        stated, stated_starts = straightened(search, before)
        other = search.confirm(stated, stated_starts, item, to, without=without)
        if other.strength(found) > 0:
            return other, search.starts()
    return found, found_starts


def nearly_as_good(
    search: Search, before: Hypothesis, best: Hypothesis, confirmed: list[Confirmed]
) -> list[Ranked]:
    """What else was added to `before` and explained as much as `best` does, to within what chance may bring."""
    found: dict[tuple[str, str], Ranked] = {}
    for strength, other, _ in confirmed:
        candidate = other.effects[-1]
        if candidate.key != best.effects[-1].key and best.strength(other) < 1.0:
            step = amplitudes_of(search.parameters, other.fit.vector, candidate)
            found[candidate.key] = Ranked(candidate, step, other.gain(before), strength)
    return sorted(found.values(), key=lambda item: -item.strength)


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
    _, found, starts = confirmed
    search.restart(starts)
    own = found.effects[-1]
    ranked = search.rank(found.fit.vector, found.effects, (found.horizon,), instead=own)
    gains = {item.candidate.key: item.gain for item in ranked}
    least = NEAR * gains.get(own.key, 0.0)
    return [
        part
        for part in parts
        if part.candidate.key != own.key and gains.get(part.candidate.key, 0.0) >= least
    ]


def adopted(search: Search, base: Hypothesis, starts: Starts, item: Ranked) -> tuple[Hypothesis, Starts]:
    """`base` with the candidate as it was ranked, the starts settled and no parameter moved."""
    search.restart(starts)
    return settled_at(
        search, *with_candidate(search.parameters, base.effects, base.fit.vector, item.candidate, item.step)
    )


def settled_at(
    search: Search, effects: tuple[Candidate, ...], vector: np.ndarray
) -> tuple[Hypothesis, Starts]:
    """These effects and parameters as they are, the starts alone settled."""
    settled = search.settle(vector)
    return Hypothesis(effects, settled, 1, {1: settled.cost}), search.starts()


def straightened(search: Search, base: Hypothesis) -> tuple[Hypothesis, Starts]:
    """The hypothesis with the nominal parameters where they were stated, the starts settled."""
    vector = base.fit.vector.copy()
    vector[: len(search.parameters.nominal)] = 0.0
    return settled_at(search, base.effects, vector)


def _worth_it(before: Hypothesis, after: Hypothesis) -> bool:
    """False for an effect that leaves most of a misfit that is clearly there."""
    horizon = max(before.costs.keys() & after.costs.keys())
    count = before.fit.count
    left, gone = before.costs[horizon] / count - 1, (before.costs[horizon] - after.costs[horizon]) / count
    return left < SMALL or gone > HALF * left


def simplest(search: Search, confirmed: list[Confirmed]) -> Confirmed:
    """Of the hypotheses that explain practically the same, the one with the fewest parameters.

    Of as many parameters the one that beats the other at the horizon where they differ most. Unless
    one of the others follows clearly better for longer than they were fitted.
    """
    most = max(strength for strength, _, _ in confirmed)
    tied = [entry for entry in confirmed if entry[0] >= most - LEAD * abs(most)]
    tied.sort(key=lambda entry: (entry[1].effects[-1].count, -entry[0]))

    def followed(entry: Confirmed) -> Hypothesis:
        search.restart(entry[2])
        return search.climb(entry[1].effects, entry[1].fit.vector, ceiling=CLOSE)

    chosen = tied[0]
    for entry in confirmed:
        if entry[1] is chosen[1] or entry[1].effects[-1].count != chosen[1].effects[-1].count:
            continue
        first, second = chosen, entry
        if min(second[1].strength(first[1]), first[1].strength(second[1])) > 0:
            first, second = _settled(search, first), _settled(search, second)
        chosen = second if second[1].strength(first[1]) > first[1].strength(second[1]) else first
    further = followed(chosen) if len(tied) > 1 and chosen[1].horizon < HORIZONS[-1] else None
    if further is not None and further.fit.level > FAIR:
        for entry in tied:
            if entry is chosen:
                continue
            other = followed(entry)
            if other.strength(further) > STRONG and _worth_it(further, other):
                chosen, further = entry, other
    return chosen


def _settled(search: Search, confirmed: Confirmed) -> Confirmed:
    """The same with what its parameters, better by what longer horizons taught them, leave over the shortest."""
    strength, found, starts = confirmed
    search.restart(starts)
    again = search.climb(found.effects, found.fit.vector, to=HORIZONS[0])
    short = min(again.costs[HORIZONS[0]], found.costs[HORIZONS[0]])
    return strength, dataclasses.replace(found, costs=found.costs | {HORIZONS[0]: short}), starts


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
