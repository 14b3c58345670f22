"""Which of many parts of the arm could be meant: each fitted to a part of the pieces, the few best kept."""

import itertools

import numpy as np

from .hypothesis import CLOSE, HORIZONS, Hypothesis, Ranked, Search, allowance, freedom
from .runs import Starts

SHORT_LIST = 3
NEAR = 0.5  # of the strongest: rivals below it are not fitted
CLEAR = 10.0  # times the allowance: a gain over a tenth of a second that tells parts apart
WORSE = 1e-3  # misfit a reading by which a fit with one more effect is no fit
ASIDE = 0.03  # the same, of what is left beyond the noise


def sift(search: Search, base: Hypothesis, starts: Starts, items: list[Ranked], horizon: int) -> list[Ranked]:
    """The few that explain most over `horizon`, each fitted in full.

    Parameters that were bent to imitate an effect mislead a test to first order. A part of the pieces
    says as well as all which of them it is.
    """
    search.restart(starts)
    search = search.thinned(horizon)
    starts = search.starts()
    nothing = search.climb(base.effects, base.fit.vector, to=horizon)
    if horizon == HORIZONS[0]:
        search.restart(starts)
        items = _likely(search, base, items)
    elif nothing.horizon == horizon and nothing.fit.level < CLOSE:
        items = _promising(search, nothing, items)
    best: dict[tuple[str, str], tuple[float, Ranked]] = {}
    for item, found in _followed(search, base, starts, items, nothing, horizon):
        cost = found.costs.get(horizon, np.inf)
        if item.candidate.key not in best or cost < best[item.candidate.key][0]:
            best[item.candidate.key] = cost, item
    left = nothing.costs.get(horizon, np.inf)
    ranked = sorted(best.values(), key=lambda entry: entry[0])[:SHORT_LIST]
    return [item for cost, item in ranked if left - cost >= NEAR * (left - ranked[0][0])]


def _followed(
    search: Search, base: Hypothesis, starts: Starts, items: list[Ranked], nothing: Hypothesis, horizon: int
) -> list[tuple[Ranked, Hypothesis]]:
    """Each of the items fitted over `horizon`, but for those far behind one that is clearly ahead over the shortest."""
    begun = [(item, search.confirm(base, starts, item, HORIZONS[0]), search.starts()) for item in items]
    short = HORIZONS[0]
    most = max((nothing.costs[short] - found.costs[short] for _, found, _ in begun), default=0.0)
    clear = most > CLEAR * allowance(nothing.fit.count, short)
    followed = []
    for item, found, found_starts in begun:
        if clear and nothing.costs[short] - found.costs[short] < NEAR * most:
            continue
        search.restart(found_starts)
        longer = search.climb(found.effects, found.fit.vector, to=horizon, without=nothing, begun=found)
        followed.append((item, longer))
    return followed


def _promising(search: Search, nothing: Hypothesis, items: list[Ranked]) -> list[Ranked]:
    """Those that gain most to first order, where a hypothesis that leaves little is fitted without them.

    What makes no sense beside its parameters, bent as they are, may do so beside others: where it is
    begun from some size it is among them.
    """
    tried = list(dict.fromkeys(item.candidate for item in items))
    ranked = search.scored(nothing.fit.vector, nothing.effects, tried, (nothing.horizon,))
    keys = [one.candidate.key for one in ranked]
    best = keys[: 2 * SHORT_LIST]
    return [
        item
        for item in items
        if item.candidate.key in best or (item.candidate.key not in keys and any(item.step))
    ]


def _likely(search: Search, base: Hypothesis, items: list[Ranked]) -> list[Ranked]:
    """Those that may be among the best over the shortest horizon.

    One set of slopes says which of them it is not, unless what it comes to is worse than nothing added.
    """
    wanted = [freedom(search.parameters, (*base.effects, item.candidate)).columns for item in items]
    columns = sorted(set(itertools.chain.from_iterable(wanted)))
    for run in search.runs:
        search.problem.linearise(run, base.fit.vector, columns)
    starts = search.starts()
    once = search.climb(base.effects, base.fit.vector, to=HORIZONS[0], most=1).fit
    quick = [search.confirm(base, starts, item, HORIZONS[0], most=1).fit.cost for item in items]
    order = sorted(zip(quick, items, strict=True), key=lambda entry: entry[0])
    limit = once.cost + max(WORSE * once.count, ASIDE * (once.cost - once.count))
    likely = [item for cost, item in order if cost <= limit][: 2 * SHORT_LIST]
    return [*likely, *(item for cost, item in order if not cost <= limit)]
