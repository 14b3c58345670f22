"""Joints whose motor and link may come apart: backlash, and springs that do not follow at once.

Such a joint has a coordinate more than the nominal one, and play leaves no trace in the slopes
about a motion without it. So they are tried on an arm of their own, from several sizes, when
nothing else explains what was measured.
"""

import dataclasses
import itertools
from collections.abc import Sequence

import numpy as np

from ..files.arm_file import ArmFile
from ..files.recording import Recording
from .calibrate import Freedom, fit
from .catalogue import Candidate
from .hypothesis import Hypothesis, Search, adopt, freedom
from .parameters import Parameters
from .study import Say, Study

GUESSES = {  # of CONTACT: value, and relative uncertainty
    "contact_stiffness": (100.0, 0.5),  # N m/rad
    "contact_damping": (0.03, 1.0),  # N m s/rad
    "motor_share": (0.6, 0.3),
}
GAPS = (0.002, 0.004, 0.008, 0.016, 0.032, 0.064)  # rad
COMPLIANCES = (0.02, 0.1, 0.5)  # rad/(N m)
FITTED = 3  # of the trials, those that fit best as they are


def loosened(file: ArmFile, joint: int) -> ArmFile:
    """The arm with motor and link of a joint apart, tied by a stiff spring."""
    values = {name: value for name, (value, _) in GUESSES.items()}
    joints = list(file.arm.joints)
    joints[joint] = dataclasses.replace(joints[joint], play=0.0, **values)
    arm = dataclasses.replace(file.arm, joints=tuple(joints))
    spread = {name: spread for name, (_, spread) in GUESSES.items()}
    return dataclasses.replace(file, arm=arm, uncertainty=file.uncertainty | spread)


def trials(joint: int) -> list[tuple[Candidate, float]]:
    """What may be between motor and link, with the size to start from."""
    location = f"joint_{joint + 1}"
    return [
        *((Candidate("backlash", location, ("gap",)), gap) for gap in GAPS),
        *((Candidate("joint_flexibility", location, ("compliance",)), size) for size in COMPLIANCES),
    ]


def loose_joints(
    file: ArmFile, recordings: Sequence[Recording], divided: bool, say: Say
) -> list[tuple[Study, Hypothesis]]:
    """For every joint, the best of its trials over the shortest horizon."""
    found = []
    for joint, own in enumerate(file.arm.joints):
        lumped = any(getattr(link, "model", "") == "lumped" for link in file.arm.links[joint : joint + 1])
        if lumped or own.play is not None:
            continue
        study = Study(loosened(file, joint), recordings, divided, say)
        search = study.search
        straight = search.settle(search.parameters.start)
        places = [(straight.vector, search.starts())]
        bent = search.climb((), straight.vector, to=1)
        places.append((bent.fit.vector, search.starts()))
        tried = []
        for (candidate, size), (vector, starts) in itertools.product(trials(joint), places):
            search.restart(starts)
            with_it = adopt(search.parameters, vector, candidate, (size,))
            if candidate.effect == "backlash":
                press(search, with_it, joint, size)
            settled = search.settle(with_it)
            tried.append((settled.cost, len(tried), candidate, settled.vector, search.starts()))
        best = None
        for _, _, candidate, vector, starts in sorted(tried)[:FITTED]:
            search.restart(starts)
            contact = contact_columns(search.parameters, candidate)
            close = fit(search.problem, search.runs, vector, contact, 1, 2).vector
            fitted = search.climb((candidate,), close, to=1, iterations=8)
            say(f"tried {candidate.effect} at {candidate.location}: {fitted.fit.level:.3g}")
            if best is None or fitted.fit.cost < best[0].fit.cost:
                best = fitted, search.starts()
        assert best is not None
        search.restart(best[1])
        found.append((study, best[0]))
    return found


def is_of_loose_joint(parameters: Parameters, effect: Candidate) -> bool:
    """True of what the arm of these parameters was taken apart for."""
    if effect.effect not in ("backlash", "joint_flexibility"):
        return False
    return parameters.arm.joints[effect.index].play is not None


def contact_columns(parameters: Parameters, candidate: Candidate) -> Freedom:
    """Leave to move the contact alone, with the rest of the arm as it is."""
    free = freedom(parameters, (candidate,))
    nominal = parameters.nominal
    own = [
        k for k, column in enumerate(free.columns) if column >= len(nominal) or nominal[column].is_of_contact
    ]
    return Freedom(
        tuple(free.columns[k] for k in own),
        *(part[own] for part in (free.precision, free.centre, free.lowest, free.far)),
    )


def press(search: Search, vector: np.ndarray, joint: int, gap: float) -> None:
    """Start every piece with the flank pressed that the moment of the bent link presses.

    Where nothing bends, with that from which the piece fits better.
    """
    model = search.parameters.arm.assemble()
    first = len(model.joints) + sum(link.shapes for link in model.links[:joint])
    link = model.links[joint]
    last = first + link.shapes - 1
    if link.shapes > 1:
        curvature = np.array([float(c) for c in link.gauge_curvature])
        for run in search.runs:
            run.starts[:, last] = np.sign(run.starts[:, first : last + 1] @ curvature) * gap / 2
        return
    before = search.starts()
    found = []
    for side in (-gap / 2, gap / 2):
        search.restart(before)
        for run in search.runs:
            run.starts[:, last] = side
        search.settle(vector)
        misfits = [search.problem.misfit(run, search.problem.predict(run, vector)) for run in search.runs]
        found.append((search.starts(), misfits))
    (lower, at_lower), (upper, at_upper) = found
    for k, run in enumerate(search.runs):
        better = at_lower[k] < at_upper[k]
        run.starts = np.where(better[:, None], lower[k][0], upper[k][0])
        run.slopes = None
