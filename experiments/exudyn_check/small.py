"""Small motion: natural frequencies, and the path of the tip."""

import jax.numpy as jnp
import numpy as np

import jaxflex as jf

from .arms import one_link, two_links
from .beams import BeamArm
from .compare import Pair, both, sine

COMPARED = 4  # elastic frequencies of every case


def frequencies(elements: int, payloads, links=(1, 2)) -> dict[str, dict[str, list[float]]]:
    """Elastic frequencies [Hz] of both programs, joints free and locked; `links` of the arms compared."""
    cases = {}
    for payload in payloads:
        grams = f"{1000 * payload:.0f} g"
        if 1 in links:
            cases[f"one link, {grams}"] = (one_link(payload, modes=4), [0.0])
        for bend in (0.0, 90.0):
            cases[f"two links, {grams}, second joint at {bend:.0f} deg"] = (
                two_links(payload),
                [0.0, np.deg2rad(bend)],
            )
    table = {}
    for name, (arm, pose) in cases.items():
        rigid = len(arm.joints)
        theirs = BeamArm(arm, pose, elements).frequencies(rigid + COMPARED)[rigid:]
        ours = jf.driven_frequencies(arm, jnp.asarray(pose))[rigid : rigid + COMPARED]
        table[f"{name}, joints free"] = _pair(theirs, ours)
        theirs = BeamArm(arm, pose, elements, locked=True).frequencies(COMPARED)
        ours = jf.locked_frequencies(arm, jnp.asarray(pose))[:COMPARED]
        table[f"{name}, joints locked"] = _pair(theirs, ours)
    return table


def refinement(elements) -> dict[str, float]:
    """Largest difference of the frequencies of one link [%] by number of Exudyn's elements."""
    arm = one_link(0.0, modes=6)
    ours = jf.locked_frequencies(arm)[:COMPARED]
    found = {}
    for n in elements:
        theirs = BeamArm(arm, [0.0], n, locked=True).frequencies(COMPARED)
        found[str(n)] = max(abs(v) for v in _pair(theirs, ours)["difference_pct"])
    return found


def _pair(theirs, ours) -> dict[str, list[float]]:
    off = 100 * (np.asarray(ours) / theirs - 1)
    return {
        "exudyn_hz": [round(float(v), 4) for v in theirs],
        "jaxflex_hz": [round(float(v), 4) for v in ours],
        "difference_pct": [round(float(v), 3) for v in off],
    }


def motions(elements: int, payloads) -> dict[str, Pair]:
    """One push and brake of every joint, a full sine of torque, the links bending by up to a twentieth."""
    pairs = {}
    for payload in payloads:
        grams = f"{1000 * payload:.0f} g"
        pairs[f"one link, {grams}"] = both(one_link(payload), [0.0], sine((0.1,), 1.0, 1, 3.0), elements)
        pairs[f"two links, {grams}"] = both(
            two_links(payload), [0.0, 0.5], sine((0.15, 0.08), 2.0, 1, 3.0), elements
        )
    return pairs
