"""Which of the effects that were found the recordings need, and which gives a law its name."""

import itertools

import numpy as np

from ..effects import EFFECTS, AbstractDryFriction, AsymmetricFriction
from .adopt import amplitudes_of, without
from .catalogue import Candidate
from .estimates import estimated
from .foretell import AT_FLOOR
from .hypothesis import Hypothesis, Search
from .loose_joint import is_of_loose_joint
from .outcome import Outcome
from .result import Estimate
from .rivals import prune
from .runs import Starts, restart
from .study import Study

CONFIRMED = 0.2  # of what held-out runs leave without an effect: what it must take away, where a gap is left
UNEVEN = 0.3  # of a joint's friction: an asymmetry larger than that is what is told of it first


def is_seen(found: dict[int, Estimate], search: Search, effect: Candidate) -> bool:
    """True of an effect with an amplitude larger than its standard deviation, or of which nothing is known."""
    amplitudes = [found[search.parameters.position(*effect.key, name)] for name in effect.amplitudes]
    known = all(np.isfinite(part.std) for part in amplitudes)
    return not (amplitudes and known) or any(abs(part.value) > part.std for part in amplitudes)


def unseen(study: Study) -> list[Candidate]:
    """What was found that comes to nothing in all recordings together."""
    final = study.everything()
    found = estimated(study.search, final)
    return [effect for effect in final.effects if not is_seen(found, study.search, effect)]


def drop_unseen(study: Study) -> None:
    """Take out of what was found the effects that come to nothing, the last first; one is kept."""
    outcome = study.outcome
    while len(outcome.final.effects) > 1 and (nothing := unseen(study)):
        effect = nothing[-1]
        study.search.say(f"{effect.effect} at {effect.location} comes to nothing in all recordings together")
        outcome.drop(outcome.final.effects.index(effect), *_refitted(study.search, outcome, effect))


def drop_unconfirmed(study: Study) -> None:
    """Take out of what was found, the last first, what held-out runs do not confirm.

    That is asked where they leave a gap: of effects that come near what was searched, and foretell nothing,
    each imitates something else. One alone need only foretell better than none; it is kept where a joint was
    taken apart for it.
    """
    search, outcome = study.search, study.outcome
    dropped = False
    while outcome.final.effects and (found := study.foretold()).level > AT_FLOOR:
        last = outcome.final.effects[-1]
        alone = len(outcome.final.effects) == 1
        if alone and is_of_loose_joint(search.parameters, last):
            break
        rest, starts = _refitted(search, outcome, last)
        share = 0.0 if alone else CONFIRMED
        if found.level - 1 < (1 - share) * (study.foretold_by(rest).level - 1):
            restart(study.prepared.held_out, found.starts)
            break
        search.say(f"{last.effect} at {last.location} is not confirmed by what was held out")
        outcome.drop(len(rest.effects), rest, starts)
        dropped = True
    if dropped and outcome.final.effects:
        prune(search, outcome)
    search.restart(outcome.final_starts)


def _refitted(search: Search, outcome: Outcome, effect: Candidate) -> tuple[Hypothesis, Starts]:
    """What was found without the effect, and where its pieces start."""
    search.restart(outcome.final_starts)
    final = outcome.final
    rest = tuple(other for other in final.effects if other is not effect)
    vector = without(search.parameters, final.fit.vector, effect)
    return search.climb(rest, vector, to=final.horizon), search.starts()


def name_uneven_first(search: Search, outcome: Outcome) -> None:
    """Put a large asymmetry before the dry friction whose law it makes another, whichever was found first."""
    effects, vector = outcome.final.effects, outcome.final.fit.vector

    def size(effect: Candidate) -> float:
        return max(map(abs, amplitudes_of(search.parameters, vector, effect)))

    for (first, friction), (later, other) in itertools.combinations(enumerate(effects), 2):
        rubs = issubclass(EFFECTS[friction.effect], AbstractDryFriction)
        uneven = issubclass(EFFECTS[other.effect], AsymmetricFriction)
        if rubs and uneven and other.location == friction.location and size(other) > UNEVEN * size(friction):
            outcome.put(later, first)
            return
