"""Links with more modes, where a joint sticks.

Dry friction grips and lets go within milliseconds: in that time a motor feels the inertia of the link less
what upper modes take along, and too few of them leave it too much.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from ..effects import EFFECTS, AbstractDryFriction
from ..files.recording import Recording
from .find import find_from
from .hypothesis import STRONG
from .parameters import Parameters
from .prepare import bends_by_fewer, with_modes
from .runs import Starts
from .study import Study
from .trial import settled_at

MODES = 3  # a link
SOMETHING = 1.1  # misfit a reading over the longest horizon that more modes could better
LOST = 100.0  # times the misfit over the shortest horizon: more modes than the parameters, as found, can have
NEARLY = 0.02  # of the misfit beyond the noise without any effect: what they could not make up for


def is_coarse(study: Study) -> bool:
    """True if dry friction was found before links of few modes, and explains nearly all."""
    outcome = study.outcome
    sticks = any(issubclass(EFFECTS[effect.effect], AbstractDryFriction) for effect in outcome.final.effects)
    near = SOMETHING < outcome.level < max(SOMETHING, 1 + NEARLY * (outcome.nominal_level - 1))
    return sticks and near and any(bends_by_fewer(link, MODES) for link in study.file.arm.links)


def finer(study: Study, recordings: Sequence[Recording]) -> Study | None:
    """The same with more modes a link, searched on from what was found; None if that is no better."""
    study.search.say(f"links are given {MODES} modes")
    file = dataclasses.replace(study.file, arm=with_modes(study.file.arm, MODES))
    carried = bool(study.prepared.problem.setting.hidden)
    other = Study(file, recordings, study.held_out, study.search.say, carried)
    final = study.outcome.final
    other.search.restart(
        _widened(study.outcome.final_starts, study.search.parameters, other.search.parameters)
    )
    begun, _ = settled_at(other.search, final.effects, final.fit.vector)
    if not begun.closest < LOST * final.closest:
        return None
    other.outcome = find_from(other.search, begun, study.outcome)
    if not other.outcome.final.strength(final) > STRONG:
        return None
    other.notes = (
        *study.notes,
        f"links are given {MODES} modes: fewer leave too much inertia where friction grips",
    )
    return other


def _widened(starts: Starts, few: Parameters, more: Parameters) -> Starts:
    """Starts of pieces of an arm with fewer modes as those of one with more, which are still."""
    narrow, wide = few.arm.assemble(), more.arm.assemble()
    places = list(range(len(narrow.joints)))
    before = len(places)
    for old, new in zip(narrow.links, wide.links, strict=True):
        # the last coordinate of a link that is loose is its twist
        bending = old.shapes - old.loose
        places += [
            *range(before, before + bending),
            *range(before + new.shapes - old.loose, before + new.shapes),
        ]
        before += new.shapes
    n, m = narrow.size, wide.size
    found = []
    for kept, _ in starts:
        wider = np.zeros((len(kept), kept.shape[1] + 2 * (m - n)))
        wider[:, places], wider[:, [m + place for place in places]] = kept[:, :n], kept[:, n : 2 * n]
        wider[:, 2 * m :] = kept[:, 2 * n :]
        found.append((wider, None))
    return found
