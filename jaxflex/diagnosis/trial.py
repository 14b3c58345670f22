"""Candidates fitted beside what was found before them, and the best of them.

Where a tenth of a second leaves much, one in some of the pieces tells which it is as well as all do.
"""

import dataclasses
from typing import NamedTuple

import numpy as np

from .adopt import amplitudes_of, held_by, with_candidate
from .catalogue import Candidate
from .hypothesis import CLOSE, FAIR, HORIZONS, STRONG, Hypothesis, Ranked, Search
from .runs import Starts

SMALL = 0.3  # misfit a reading, beyond the noise floor, that leaves room for small effects
SHARE = 0.3  # of a larger one that an effect has to explain
HALF = 0.5  # the same, beside others that leave so much over the shortest horizon
LEAD = 0.01  # of the gain: what a hypothesis with more parameters must be better by


class Confirmed(NamedTuple):
    """A candidate as fitted: by how much it beats what was there, the hypothesis, and where its pieces start.

    `begun`: where all pieces start before it.
    """

    strength: float
    found: Hypothesis
    starts: Starts
    begun: Starts


class Trial:
    """Candidates tried beside a hypothesis that is `fitted`, its pieces starting at `starts`.

    `explained` as for `Hypothesis.strength`; `by_some`: a part of the pieces will do, whose `share` it is;
    `horizon`: up to which they are fitted. `confirmed`: those that make sense, as fitted.
    """

    def __init__(
        self,
        search: Search,
        fitted: Hypothesis,
        starts: Starts,
        explained: dict[int, float],
        by_some: bool,
        horizon: int = HORIZONS[-1],
    ):
        self.whole = search
        self.by_some = by_some and search.has_to_spare
        self.search, self.fitted = search.by_some(fitted, starts) if self.by_some else (search, fitted)
        self.horizon = min(horizon, self.fitted.horizon)
        self.share = self.fitted.fit.count / fitted.fit.count
        self.explained = {horizon: self.share * cost for horizon, cost in explained.items()}
        self.confirmed: list[Confirmed] = []
        # of those that were compared, by their identity
        self._settled: dict[int, Confirmed] = {}
        self._followed: dict[int, Hypothesis] = {}

    def _begun(self, starts: Starts) -> Search:
        self.whole.restart(starts)
        return self.whole.thinned() if self.by_some else self.whole

    def confirm(self, items: list[Ranked], before: Hypothesis, starts: Starts) -> None:
        """Fit each of the candidates, added to `before`, whose pieces start at `starts`."""
        search = self._begun(starts)
        begun = search.starts()
        for item in items:
            found, found_starts = confirmed_from(
                search, before, begun, item, self.horizon, without=self.fitted
            )
            search.say(f"tried {item.candidate.effect} at {item.candidate.location}: {found.fit.level:.3g}")
            if search.sensible(found):
                strength = found.strength(self.fitted, self.explained)
                self.confirmed.append(Confirmed(strength, found, found_starts, starts))

    @property
    def worthy(self) -> list[Confirmed]:
        """Those that take enough of what is left."""
        return [entry for entry in self.confirmed if worth_it(self.fitted, entry.found)]

    def simplest(self, confirmed: list[Confirmed]) -> Confirmed:
        """Of the hypotheses that explain practically the same, the one with the fewest parameters.

        Of as many parameters the one that beats the other at the horizon where they differ most. Unless
        one of the others follows clearly better for longer than they were fitted.
        """
        most = max(entry.strength for entry in confirmed)
        tied = [entry for entry in confirmed if entry.strength >= most - LEAD * abs(most)]
        tied.sort(key=lambda entry: (entry.found.effects[-1].count, -entry.strength))
        chosen = tied[0]
        for entry in confirmed:
            if entry.found is chosen.found or entry.found.effects[-1].count != chosen.found.effects[-1].count:
                continue
            first, second = chosen, entry
            if min(second.found.strength(first.found), first.found.strength(second.found)) > 0:
                first, second = self.settled(first), self.settled(second)
            chosen = (
                second if second.found.strength(first.found) > first.found.strength(second.found) else first
            )
        further = self.followed(chosen) if len(tied) > 1 and chosen.found.horizon < HORIZONS[-1] else None
        if further is not None and further.fit.level > FAIR:
            for entry in tied:
                if entry is chosen:
                    continue
                other = self.followed(entry)
                if other.strength(further) > STRONG and worth_it(further, other):
                    chosen, further = entry, other
        return chosen

    def settled(self, confirmed: Confirmed) -> Confirmed:
        """The same with what its parameters, better by what longer horizons taught them, leave over the shortest."""
        found = confirmed.found
        if id(found) not in self._settled:
            self.search.restart(confirmed.starts)
            again = self.search.climb(found.effects, found.fit.vector, to=HORIZONS[0])
            short = min(again.costs[HORIZONS[0]], found.costs[HORIZONS[0]])
            costs = found.costs | {HORIZONS[0]: short}
            known = confirmed._replace(found=dataclasses.replace(found, costs=costs))
            self._settled |= {id(found): known, id(known.found): known}
        return self._settled[id(found)]

    def followed(self, confirmed: Confirmed) -> Hypothesis:
        """The same fitted to all pieces over as long as it follows."""
        found = confirmed.found
        if id(found) not in self._followed:
            self._followed[id(found)] = followed(self.whole, *self.base(confirmed), found.fit.vector)[0]
        return self._followed[id(found)]

    def base(self, confirmed: Confirmed) -> tuple[Hypothesis, Starts]:
        """Where to go on from with one of them, and where all pieces start there.

        As fitted, if to all of them; else with the arm as it was stated.
        """
        if not self.by_some:
            return confirmed.found, confirmed.starts
        self.whole.restart(confirmed.begun)
        return straightened(self.whole, confirmed.found)


def followed(
    search: Search, base: Hypothesis, starts: Starts, vector: np.ndarray
) -> tuple[Hypothesis, Starts]:
    """The hypothesis fitted from `vector` over as long as it follows, and where its pieces start."""
    search.restart(starts)
    # where nothing shows a load, a fit comes nearer each time that it is gone on with
    begun = base if base.is_fitted and not search.problem.setting.hidden else None
    return search.climb(base.effects, vector, ceiling=CLOSE, begun=begun), search.starts()


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


def worth_it(before: Hypothesis, after: Hypothesis) -> bool:
    """False for an effect that leaves most of a misfit that is clearly there."""
    horizon = max(before.costs.keys() & after.costs.keys())
    count = before.fit.count
    left, gone = before.costs[horizon] / count - 1, (before.costs[horizon] - after.costs[horizon]) / count
    share = HALF if before.effects and before.closest > CLOSE else SHARE
    return left < SMALL or gone > share * left


def nearly_as_good(
    search: Search, before: Hypothesis, best: Hypothesis, confirmed: list[Confirmed]
) -> list[Ranked]:
    """What else was added to `before` and explained as much as `best` does, to within what chance may bring."""
    found: dict[tuple[str, str], Ranked] = {}
    for strength, other, *_ in confirmed:
        candidate = other.effects[-1]
        if candidate.key != best.effects[-1].key and best.strength(other) < 1.0:
            step = amplitudes_of(search.parameters, other.fit.vector, candidate)
            found[candidate.key] = Ranked(candidate, step, other.gain(before), strength)
    return sorted(found.values(), key=lambda item: -item.strength)


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
