"""What each effect that was found is worth: is it needed still, and would another one do?"""

import dataclasses

import numpy as np

from .adopt import amplitudes_of, without
from .catalogue import Candidate
from .departure import is_suspect, straightens
from .hypothesis import CLOSE, FAIR, HORIZONS, STRONG, Hypothesis, Ranked, Search
from .loose_joint import is_of_loose_joint
from .outcome import Outcome
from .runs import Starts

MOST = 2  # rivals of an effect that are tried
TIE = 0.05  # of the gain: rivals nearer than this are not told apart
VERY_NEAR = 1.1  # misfit a reading that leaves nothing a rival could be better at
HARDLY_MORE = 0.5  # of what is left in either case: a rival that leaves this much more is no worse


def prune(search: Search, outcome: Outcome) -> None:
    """Drop every effect that a later one made needless; note what each of the others is worth."""
    gains: dict[tuple[str, str], float] = {}
    for effect in list(outcome.final.effects):
        if len(outcome.final.effects) == 1:
            gains[effect.key] = outcome.final.gain(outcome.nominal)
            continue
        rest = tuple(e for e in outcome.final.effects if e is not effect)
        vector = without(search.parameters, outcome.final.fit.vector, effect)
        size = amplitudes_of(search.parameters, outcome.final.fit.vector, effect)
        gone = bool(size) and not any(size)  # another took over all that it did
        if rest in outcome.passed and not gone:
            found, starts = outcome.passed[rest]
        elif not gone and (lost := _lost_by_some(search, outcome, rest, vector)):
            gains[effect.key] = lost
            continue
        else:
            search.restart(outcome.final_starts)
            found = search.climb(rest, vector, ceiling=np.inf if gone else CLOSE, iterations=3)
            starts = search.starts()
        needed = outcome.final.strength(found) >= STRONG or straightens(
            search.parameters, found, outcome.final, outcome.explained
        )
        if gone or (found.horizon == outcome.final.horizon and not needed):
            search.say(f"{effect.effect} at {effect.location} is no longer needed")
            outcome.final, outcome.final_starts = found, starts
        else:
            gains[effect.key] = outcome.final.gain(found)
    search.restart(outcome.final_starts)
    outcome.gains = [gains.get(effect.key, np.inf) for effect in outcome.final.effects]


def _lost_by_some(search: Search, outcome: Outcome, rest: tuple[Candidate, ...], vector: np.ndarray) -> float:
    """What a part of the pieces shows that the final hypothesis gains on one with the effects of `rest` alone.

    0 if such a one follows, or is nearly as good, or where no part of them can say.
    """
    if not search.has_to_spare:
        return 0.0
    few, own = search.by_some(outcome.final, outcome.final_starts)
    found = few.climb(rest, vector, to=HORIZONS[0], iterations=3)
    if found.closest < CLOSE * max(own.closest, 1.0) or own.strength(found) < STRONG:
        return 0.0
    return own.gain(found) * outcome.final.fit.count / own.fit.count


def weigh(search: Search, outcome: Outcome) -> None:
    """Find the rivals that explain as much as an effect that was added.

    One that explains more, or as much with fewer parameters, takes its place.
    """
    for place, effect in enumerate(outcome.final.effects):
        if is_of_loose_joint(search.parameters, effect):
            continue  # found because nothing else would do
        final, starts = outcome.final, outcome.final_starts
        rest = tuple(e for e in final.effects if e is not effect)
        search.restart(starts)
        found = search.rivals(final, effect)[:MOST]
        hopeless = CLOSE * max(final.closest, 1.0)  # over a shorter horizon
        ranked = {item.candidate.key for item, _ in found} | {e.key for e in final.effects}
        close = [item for item in outcome.close.get(effect.key, ()) if item.candidate.key not in ranked]
        for item, share in (*found, *((item, item.gain) for item in close[:MOST])):
            vector = without(search.parameters, final.fit.vector, effect)
            base = dataclasses.replace(final, effects=rest, fit=dataclasses.replace(final.fit, vector=vector))
            if not _promises(search, outcome, base, starts, item, hopeless):
                continue
            rival = search.confirm(base, starts, item, final.horizon, ceiling=hopeless)
            if rival.horizon != final.horizon or not search.sensible(rival):
                continue
            if is_suspect(search.parameters, rival, outcome.explained) and not is_suspect(
                search.parameters, final, outcome.explained
            ):
                continue
            lost = final.gain(rival)
            worth, left = max(share, outcome.gains[place]), final.fit.cost - final.fit.count
            alike = final.strength(rival) < 1.0 or lost < HARDLY_MORE * left
            same = lost < TIE * worth and alike
            # another form of what is there would explain a little more, whatever is there
            better = lost < 0 and (
                rival.strength(final, outcome.explained_over()) > STRONG
                or (is_all_there_is(final, rival) and item.candidate.count <= effect.count)
            )
            simpler = same and item.candidate.count < effect.count
            if better or simpler:
                search.say(
                    f"{item.candidate.effect} at {item.candidate.location} in place of {effect.effect}"
                )
                order = (*rest[:place], item.candidate, *rest[place:])
                outcome.final, outcome.final_starts = (
                    dataclasses.replace(rival, effects=order),
                    search.starts(),
                )
                outcome.rivals = [entry for entry in outcome.rivals if entry[0] != place]
                break
            if same:
                outcome.rivals.append((place, rival))
    search.restart(outcome.final_starts)


def _promises(
    search: Search, outcome: Outcome, base: Hypothesis, starts: Starts, item: Ranked, limit: float
) -> bool:
    """False for a candidate in place of an effect that a part of the pieces shows to be worse.

    It leaves more than `limit`; or, where nothing is left over the longest horizon that it could be better at,
    clearly more than the final hypothesis does.
    """
    final = outcome.final
    at_floor = final.fit.level < VERY_NEAR
    if outcome.nominal.closest < limit and not at_floor:
        return True
    few, own = search.by_some(final, starts)
    rival = few.confirm(base, few.starts(), item, HORIZONS[0])
    return rival.closest < limit and not (at_floor and own.strength(rival) > STRONG)


def is_all_there_is(other: Hypothesis, rival: Hypothesis) -> bool:
    """True if the rival leaves only noise where the other leaves more."""
    return rival.fit.level < FAIR and other.fit.level > CLOSE
