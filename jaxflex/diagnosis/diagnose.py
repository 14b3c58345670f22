"""Find where simulation and measurement disagree, name what is missing, add it, show the gap shrink."""

import dataclasses
import time
from collections.abc import Callable, Sequence

import numpy as np

from ..effects import EFFECTS
from ..files.arm_file import ArmFile
from ..files.recording import Recording
from .describe import AT_FLOOR, describe, judge, level, nominally
from .gauge import by_gauge
from .hypothesis import (
    CHANCE,
    CLOSE,
    HORIZONS,
    PARTS,
    Hypothesis,
    Outcome,
    Ranked,
    Search,
    Starts,
    allowance,
    without,
)  # fmt: skip
from .loose_joint import loose_joints
from .prepare import Prepared, make_problem
from .result import Diagnosis

MOST_EFFECTS = 5
STRONG = 3.0  # times the allowance: a candidate worth a full fit, and a gain worth an effect
SHORT_LIST = 3
NEAR = 0.5  # of the strongest: rivals below it are not fitted
FAIR = 1.5  # misfit a reading over a second, in units of the noise, that leaves nothing to explain
LITTLE = 0.01  # of the gap there was: what may be left over a second where a tenth of one is followed
SMALL = 0.3  # misfit a reading, beyond the noise floor, that leaves room for small effects
HALF = 0.3  # of a larger one that an effect has to explain
LEAD = 0.01  # of the gain: what a hypothesis with more parameters must be better by
FAR = 10.0  # misfit a reading that bends all parameters, whatever is missing
HALFWAY = 0.5  # of such a misfit: what an effect that brings it lower has to be right about
SOLVED = 0.2  # of what is left of a gap: a joint that comes apart, with all it adds, must leave less
BY_GAUGE = (
    "the tip's deflection is followed far better as what a strain gauge at the root shows, scaled under a weight "
    "at the tip (deflection_from = 'gauge'); at high frequencies the two differ"
)
TIE = 0.05  # of the gain: rivals nearer than this are not told apart


Confirmed = tuple[float, Hypothesis, Starts]  # strength, hypothesis, and where its pieces start


def diagnose(
    file: ArmFile, recordings: Sequence[Recording], say: Callable[[str], None] | None = None
) -> Diagnosis:
    """Compare the arm of `file` with `recordings` and name what it lacks.

    Nominal parameters are calibrated within the uncertainty that the file states. Half of
    the recordings (the last 40 % of a single one) are held out to judge by; where those show
    what the others do not, the last 40 % of each instead. `say` is told of the progress, a
    line at a time.

    **Returns** a `Diagnosis` with one of four verdicts.

    **Raises** `RecordingError` if the recordings do not fit the arm.
    """
    began = time.perf_counter()
    say = say or (lambda line: None)
    prepared = make_problem(file, recordings)
    search = Search(prepared.problem, prepared.calibration, say)
    outcome = find(search)
    divided = bool(outcome.level < FAIR and _foretells(prepared, outcome) > AT_FLOOR and len(recordings) > 1)
    if divided:
        say("the runs held out show what the others do not: the end of each is held out instead")
        prepared = make_problem(file, recordings, divided)
        search = Search(prepared.problem, prepared.calibration, say)
        outcome = find(search)
    nominal = nominally(prepared, search, outcome)
    gauged = by_gauge(file) if _astray(outcome) > CLOSE and _shows_deflection(prepared) else None
    if gauged is not None:
        say("the deflections may be those that a strain gauge stands for")
        other = make_problem(gauged, recordings, divided)
        searching = Search(other.problem, other.calibration, say)
        found = find(searching)
        if _astray(found) < HALFWAY * _astray(outcome):
            file, search, outcome = gauged, searching, found
            prepared = dataclasses.replace(other, notes=(*other.notes, BY_GAUGE))
    much = outcome.level > FAIR and outcome.level - 1 > LITTLE * (outcome.nominal_level - 1)
    if much or search.is_bent(outcome.final, outcome.explained):
        say("what is left may lie between a motor and its link")
        for loose, other, start in loose_joints(file, recordings, divided, say):
            found = find(other, start)
            left = _foretells(loose, found)
            gone = left - 1 < SOLVED * (_foretells(prepared, outcome) - 1)
            # of a bare axis the load is never seen, and its starts fit much that is something else
            seen = bool(file.arm.links) or left < AT_FLOOR
            if gone and seen and found.final.strength(outcome.final) > STRONG:
                found.nominal_level = outcome.nominal_level  # of the arm as it was stated
                prepared, search, outcome = loose, other, found
    weigh(search, outcome)
    return describe(file, prepared, search, outcome, nominal, began)


def _astray(outcome: Outcome) -> float:
    """Misfit a reading over the shortest horizon, in units of the noise."""
    return outcome.final.costs[HORIZONS[0]] / outcome.final.fit.count


def _shows_deflection(prepared: Prepared) -> bool:
    return any(name.startswith("tip_deflection") for name in prepared.problem.setting.channels)


def _foretells(prepared: Prepared, outcome: Outcome) -> float:
    """Misfit a reading over runs that nothing was fitted to, in units of the noise."""
    return level(prepared.problem, judge(prepared.problem, prepared.held_out, outcome.final)[0])


def find(search: Search, start: Hypothesis | None = None) -> Outcome:
    """Add effects one at a time until nothing in the catalogue stands out.

    `start`: the first of them is settled already, with the pieces starting where they are.
    """
    say = search.say
    begin = search.starts()
    settled = search.settle(search.parameters.start)
    base, base_starts = Hypothesis((), settled, 1, {1: settled.cost}), search.starts()
    outcome: Outcome | None = None
    levels: list[float] = []
    for _ in range(MOST_EFFECTS + 1):
        search.restart(base_starts)
        fitted = search.climb(base.effects, base.fit.vector, ceiling=CLOSE)
        starts = search.starts()
        say(
            f"calibrated with {len(base.effects)} effect(s): misfit {fitted.fit.level:.3g} of the noise floor"
        )
        if outcome is None:
            outcome = Outcome(fitted, starts)
        outcome.final, outcome.final_starts = fitted, starts
        levels.append(search.over_a_second(fitted))
        outcome.nominal_level, outcome.level = levels[0], levels[-1]
        if start is not None and not fitted.effects:
            base, base_starts = start, begin
            continue
        short = outcome.nominal.costs[HORIZONS[0]] - fitted.costs[HORIZONS[0]]
        long = (levels[0] - levels[-1]) * fitted.fit.count
        explained = {h: short if h == HORIZONS[0] else max(short, h / HORIZONS[-1] * long) for h in HORIZONS}
        near = fitted.costs[HORIZONS[0]] < CLOSE * fitted.fit.count
        bent = start is None and search.is_suspect(fitted)
        if fitted.effects and near and levels[-1] - 1 < LITTLE * (levels[0] - 1) and not bent:
            break
        horizons = tuple(h for h in HORIZONS if h <= fitted.horizon)
        ranked = search.rank(fitted.fit.vector, fitted.effects, horizons)
        far = fitted.fit.level > CLOSE and fitted.horizon == HORIZONS[0]
        if far:
            # a fit that the missing effect has bent is a poor place to judge from: the
            # parameters as they were before it are judged as well, over the shortest horizon
            search.restart(base_starts)
            ranked = _merge(search.rank(base.fit.vector, base.effects, (1,)), ranked)
        tried = _short_list(ranked)
        if len(fitted.effects) == MOST_EFFECTS or not (tried or bent):
            break
        before, before_starts = (base, base_starts) if far else (fitted, starts)
        confirmed: list[Confirmed] = []

        def confirm(items, before, before_starts, fitted=fitted, explained=explained, confirmed=confirmed):
            for item in items:
                found = search.confirm(before, before_starts, item, fitted.horizon)
                say(f"tried {item.candidate.effect} at {item.candidate.location}: {found.fit.level:.3g}")
                if search.sensible(found):
                    confirmed.append((found.strength(fitted, explained), found, search.starts()))

        confirm(tried, before, before_starts)
        if bent and not (confirmed and decisive(search, fitted, simplest(search, confirmed)[1])):
            search.restart(base_starts)
            straight, straight_starts = straightened(search, base)
            parts = sift(search, straight, straight_starts, search.parts(straight.effects))
            confirm(parts, straight, straight_starts)
        confirmed = [entry for entry in confirmed if _worth_it(fitted, entry[1])]
        if not confirmed:
            break
        strength, best, best_starts = simplest(search, confirmed)
        straightens = bent and not search.is_suspect(best) and _gain(fitted, best) > STRONG * CHANCE
        if not (strength > STRONG or straightens):
            break
        base, base_starts = best, best_starts
    assert outcome is not None
    search.restart(outcome.final_starts)
    prune(search, outcome)
    return outcome


def decisive(search: Search, before: Hypothesis, best: Hypothesis) -> bool:
    """True if no part of the arm need be tried beside what was found best.

    Either nothing is left; or much is, which bends all parameters, and most of it has gone.
    """
    if issubclass(EFFECTS[best.effects[-1].effect], PARTS):
        return False  # another part of the arm could be meant
    if before.fit.level > FAR and best.fit.level < HALFWAY * before.fit.level:
        return True
    return bool(best.fit.level < FAIR and not search.is_suspect(best))


def straightened(search: Search, base: Hypothesis) -> tuple[Hypothesis, Starts]:
    """The hypothesis with the nominal parameters where they were stated, the starts settled."""
    vector = base.fit.vector.copy()
    vector[: len(search.parameters.nominal)] = 0.0
    settled = search.settle(vector)
    return Hypothesis(base.effects, settled, 1, {1: settled.cost}), search.starts()


def sift(search: Search, base: Hypothesis, starts: Starts, items: list[Ranked]) -> list[Ranked]:
    """The few that explain most over the shortest horizon, each fitted in full.

    Parameters that were bent to imitate an effect mislead a test to first order.
    """
    best: dict[tuple[str, str], tuple[float, Ranked]] = {}
    for item in items:
        cost = search.confirm(base, starts, item, HORIZONS[0]).fit.cost
        if item.candidate.key not in best or cost < best[item.candidate.key][0]:
            best[item.candidate.key] = cost, item
    return [item for _, item in sorted(best.values(), key=lambda entry: entry[0])][:SHORT_LIST]


def _worth_it(before: Hypothesis, after: Hypothesis) -> bool:
    """False for an effect that leaves most of a misfit that is clearly there."""
    horizon = max(before.costs.keys() & after.costs.keys())
    count = before.fit.count
    left, gone = before.costs[horizon] / count - 1, (before.costs[horizon] - after.costs[horizon]) / count
    return bool(left < SMALL or gone > HALF * left)


def simplest(search: Search, confirmed: list[Confirmed]) -> Confirmed:
    """Of the hypotheses that explain practically the same, the one with the fewest parameters.

    Unless one of the others follows clearly better for longer than they were fitted.
    """
    most = max(strength for strength, _, _ in confirmed)
    tied = [entry for entry in confirmed if entry[0] >= most - LEAD * abs(most)]
    tied.sort(key=lambda entry: (entry[1].effects[-1].count, -entry[0]))

    def followed(entry: Confirmed) -> Hypothesis:
        search.restart(entry[2])
        return search.climb(entry[1].effects, entry[1].fit.vector, ceiling=CLOSE)

    chosen = tied[0]
    further = followed(chosen) if len(tied) > 1 and chosen[1].horizon < HORIZONS[-1] else None
    if further is not None and further.fit.level > FAIR:
        for entry in tied[1:]:
            other = followed(entry)
            if other.strength(further) > STRONG and _worth_it(further, other):
                chosen, further = entry, other
    return chosen


def _merge(first: list[Ranked], second: list[Ranked]) -> list[Ranked]:
    """Both rankings, each candidate once, the first ranking's best before the second's."""
    best = {}
    for item in (*first, *second):
        key = item.candidate.key
        if key not in best or item.strength > best[key].strength:
            best[key] = item
    return sorted(best.values(), key=lambda item: -item.strength)


def _short_list(ranked: list[Ranked]) -> list[Ranked]:
    strong = [item for item in ranked if item.strength > STRONG]
    return [item for item in strong if item.strength > NEAR * strong[0].strength][:SHORT_LIST]


def prune(search: Search, outcome: Outcome) -> None:
    """Drop every effect that a later one made needless; note what each of the others is worth."""
    gains: dict[tuple[str, str], float] = {}
    for effect in list(outcome.final.effects):
        if len(outcome.final.effects) == 1:
            gains[effect.key] = _gain(outcome.nominal, outcome.final)
            continue
        search.restart(outcome.final_starts)
        rest = tuple(e for e in outcome.final.effects if e is not effect)
        vector = without(search.parameters, outcome.final.fit.vector, effect)
        found = search.climb(rest, vector, ceiling=CLOSE, iterations=3)
        if found.horizon == outcome.final.horizon and outcome.final.strength(found) < STRONG:
            search.say(f"{effect.effect} at {effect.location} is no longer needed")
            outcome.final, outcome.final_starts = found, search.starts()
        else:
            gains[effect.key] = _gain(found, outcome.final)
    search.restart(outcome.final_starts)
    outcome.gains = [gains.get(effect.key, np.inf) for effect in outcome.final.effects]


def _gain(before: Hypothesis, after: Hypothesis) -> float:
    """Fall of the cost at the longest horizon that both were fitted over."""
    horizon = max(before.costs.keys() & after.costs.keys())
    return before.costs[horizon] - after.costs[horizon]


def weigh(search: Search, outcome: Outcome) -> None:
    """Find the rivals that explain as much as an effect that was added.

    One that explains more, or as much with fewer parameters, takes its place.
    """
    for place, effect in enumerate(outcome.final.effects):
        final, starts = outcome.final, outcome.final_starts
        rest = tuple(e for e in final.effects if e is not effect)
        search.restart(starts)
        found = search.rivals(final, effect)
        for item, share in found[:2]:
            vector = without(search.parameters, final.fit.vector, effect)
            base = dataclasses.replace(final, effects=rest, fit=dataclasses.replace(final.fit, vector=vector))
            rival = search.confirm(base, starts, item, final.horizon)
            if rival.horizon != final.horizon or not search.sensible(rival):
                continue
            lost = _gain(rival, final)
            same = lost < TIE * share and final.strength(rival) < 1.0
            better = -lost > STRONG * allowance(final.fit.count, final.horizon)
            simpler = same and item.candidate.count < effect.count
            if (better or simpler) and not search.is_of_loose_joint(effect):
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
