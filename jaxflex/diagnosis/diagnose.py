"""Find where simulation and measurement disagree, name what is missing, add it, show the gap shrink."""

import time
from collections.abc import Callable, Sequence

from ..files.arm_file import ArmFile
from ..files.recording import Recording
from .departure import is_bent
from .describe import describe
from .find import HALFWAY, find, find_from, gone_on
from .finer import finer, is_coarse
from .foretell import AT_FLOOR
from .gauge import BY_GAUGE, PROMISING, by_gauge
from .hypothesis import CLOSE, FAIR, HORIZONS, LITTLE, STRONG, Hypothesis
from .loose_joint import is_of_loose_joint, loose_joints
from .needed import drop_unconfirmed, drop_unseen, name_uneven_first, unseen
from .prepare import HeldOut
from .result import Diagnosis
from .rivals import weigh
from .signs import righted
from .study import Study

UNSEEN = 0.05  # misfit a reading by which what is held out leaves more than what was searched; usual is half of that
SOLVED = 0.2  # of what is left of a gap: a joint that comes apart, with all it adds, must leave less


def diagnose(
    file: ArmFile, recordings: Sequence[Recording], say: Callable[[str], None] | None = None
) -> Diagnosis:
    """Compare the arm of `file` with `recordings` and name what it lacks.

    Nominal parameters are calibrated within the uncertainty that the file states. Half of
    the recordings (the last 40 % of a single one) are held out to judge by; where those show
    what the others do not, the last 40 % of each instead, or the first. `say` is told of the
    progress, a line at a time.

    **Returns** a `Diagnosis` with one of four verdicts.

    **Raises** `RecordingError` if the recordings do not fit the arm.
    """
    began = time.perf_counter()
    say = say or (lambda line: None)
    recordings = righted(file, recordings)

    def study(held_out: HeldOut) -> Study:
        begun = Study(file, recordings, held_out, say)
        begun.outcome = find(begun.search)
        return begun

    chosen = study(HeldOut.RUNS)
    for held_out in (HeldOut.ENDS, HeldOut.BEGINNINGS)[len(recordings) == 1 :]:
        if not _has_not_seen(chosen):
            break
        say(f"what is held out shows what the rest does not: {held_out.value} are held out instead")
        other = study(held_out)
        if other.foretold().level < chosen.foretold().level:
            chosen = other
    first = chosen

    def gauged(chosen: Study) -> Study:
        final = chosen.outcome.final
        other_file = by_gauge(chosen.file) if final.closest > CLOSE and _deflections(chosen) else None
        if other_file is None:
            return chosen
        say("the deflections may be those that a strain gauge stands for")
        other = Study(other_file, recordings, chosen.held_out, say)
        with_gauge = other.search.thinned().climb(final.effects, final.fit.vector, to=HORIZONS[0])
        if not with_gauge.closest < PROMISING * chosen.level_of_some():
            return chosen
        other.outcome = find(other.search)
        if not other.outcome.final.closest < HALFWAY * final.closest:
            return chosen
        other.notes = (*other.notes, BY_GAUGE)
        return other

    def loosened(chosen: Study) -> Study:
        if _is_strained(chosen) if chosen.outcome.waiting else _leaves_much(chosen):
            say("what is left may lie between a motor and its link")
            for loose, start in loose_joints(chosen, recordings):
                loose.outcome = find_from(loose.search, start, chosen.outcome)
                if _solves(loose, chosen):
                    loose.notes = tuple(dict.fromkeys((*loose.notes, *chosen.notes)))
                    chosen = loose
        return chosen

    likely = (gauged, loosened) if _astray_in_deflection(chosen) else (loosened, gauged)
    for other_arm in likely:
        chosen = other_arm(chosen)
    chosen.outcome = gone_on(chosen.search, chosen.outcome)
    if is_coarse(chosen):
        chosen = finer(chosen, recordings) or chosen
    drop_unconfirmed(chosen)
    weigh(chosen.search, chosen.outcome)
    name_uneven_first(chosen.search, chosen.outcome)
    drop_unseen(chosen)
    return describe(chosen, first, began)


def _has_not_seen(study: Study) -> bool:
    """True if what is held out leaves a gap where nothing is left in what was searched.

    A small gap says so where no effect was named, whose form could be to blame, or where the arm's
    parameters went farther than they should, for what was searched or for all.
    """
    outcome, left = study.outcome, study.foretold().level
    if outcome.level >= FAIR or left <= outcome.level + UNSEEN:
        return False
    if left > AT_FLOOR or not outcome.final.effects:
        return True
    return _is_bent(study) or _is_bent(study, study.everything())


def _deflections(study: Study) -> list[str]:
    return [name for name in study.prepared.problem.setting.channels if name.startswith("tip_deflection")]


def _astray_in_deflection(study: Study) -> bool:
    """True if the channel farthest from what was foretold is a deflection."""
    misfits = study.foretold().misfits
    return max(misfits, key=lambda name: misfits[name]) in _deflections(study)


def _leaves_much(study: Study) -> bool:
    """True if what was found leaves a gap, or had to bend the arm's parameters to close it."""
    outcome = study.outcome
    much = outcome.level > FAIR and outcome.level - 1 > LITTLE * (outcome.nominal_level - 1)
    return much or _is_bent(study) or _is_strained(study)


def _is_bent(study: Study, found: Hypothesis | None = None) -> bool:
    """True if the arm's parameters had to bend for the final hypothesis, or for `found`."""
    return is_bent(study.search.parameters, found or study.outcome.final, study.outcome.explained)


def _is_strained(study: Study) -> bool:
    """True if a joint is soft, and the arm's parameters make up for what turns on the motor's side of it."""
    soft = any(effect.effect == "joint_flexibility" for effect in study.outcome.final.effects)
    return soft and _is_bent(study, study.everything())


def _solves(loose: Study, other: Study) -> bool:
    """True if a joint that comes apart explains nearly all that is left without it, or strains no parameters."""
    left = loose.foretold().level
    if _is_strained(other) and not _is_strained(loose) and left < max(AT_FLOOR, other.foretold().level):
        return True
    gone = left - 1 < SOLVED * (other.foretold().level - 1)
    if not (gone and loose.outcome.final.strength(other.outcome.final) > STRONG):
        return False
    return not any(is_of_loose_joint(loose.search.parameters, effect) for effect in unseen(loose))
