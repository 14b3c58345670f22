"""How far the arm's stated parameters had to go, and whether that speaks of something missing.

Parameters as uncertain as stated depart from their values as the square root of chi squared over their
number. What departs farther than nearly all such arms has made up for something.
"""

import numpy as np
from scipy.special import gammaincinv

from ..effects import EFFECTS, AbstractDryFriction
from .hypothesis import CLOSE, Hypothesis
from .loose_joint import is_of_loose_joint
from .parameters import Parameters

SUSPECT = 0.99  # of arms as stated, the share whose parameters depart less: beyond it parts are tried
BENT = 0.999  # the same, beyond which something is missing
FORM_ERROR = 0.01  # of its effect: what a law of friction or contact may differ from the true one by
MOST_ERROR = 1.8  # times the usual departure: what such an error is excused for before parts have been tried
UNLIKELY = 12.0  # gain of a part that sets strained parameters straight: one arm in a hundred strains
FARTHEST = 0.4  # of the departure of one parameter, to be compared with that of all


def departures(parameters: Parameters, hypothesis: Hypothesis) -> dict[str, float]:
    """How far each stated parameter of the arm went, in standard deviations."""
    return {
        part.name: float(moved)
        for part, moved in zip(parameters.nominal, hypothesis.fit.vector, strict=False)
        if not part.is_of_contact
    }


def departure(parameters: Parameters, hypothesis: Hypothesis) -> float:
    """How far the stated parameters went, root mean square, in standard deviations.

    Where nothing else is left, a share of what the farthest of them went counts too: one among
    many may have made up for what is missing.
    """
    moved = np.abs(list(departures(parameters, hypothesis).values()))
    if not moved.size:
        return 0.0
    farthest = moved.max(initial=0.0) if hypothesis.fit.level < CLOSE else 0.0
    return float(max(np.sqrt(np.mean(moved**2)), FARTHEST * farthest))


def is_suspect(parameters: Parameters, hypothesis: Hypothesis, explained: float = 0.0) -> bool:
    """True if the parameters went far enough to imitate a part of the arm that is not as stated.

    `explained` as for `is_bent`.
    """
    usual = _usual(SUSPECT, _stated(parameters))
    error = min(_error(parameters, hypothesis, explained), MOST_ERROR * usual)
    return bool(departure(parameters, hypothesis) > np.hypot(usual, error))


def straightens(
    parameters: Parameters, before: Hypothesis, after: Hypothesis, explained: float = 0.0
) -> bool:
    """True if parameters that went too far without what `after` adds go no farther than usual with it.

    `explained` as for `is_bent`.
    """
    bent, straight = (is_suspect(parameters, found, explained) for found in (before, after))
    return bent and not straight and after.gain(before) > UNLIKELY


def is_bent(parameters: Parameters, hypothesis: Hypothesis, explained: float) -> bool:
    """True if the parameters went farther than anything but something missing makes them go.

    `explained`: the cost that the effects account for. No law of friction or contact is the true
    one, and parameters make up for its error as far as that may reach.
    """
    usual = _usual(BENT, _stated(parameters))
    return bool(
        departure(parameters, hypothesis) > np.hypot(usual, _error(parameters, hypothesis, explained))
    )


def _error(parameters: Parameters, hypothesis: Hypothesis, explained: float) -> float:
    """How far parameters go to make up for the error of a law of friction or contact."""
    touches = any(
        issubclass(EFFECTS[effect.effect], AbstractDryFriction) or is_of_loose_joint(parameters, effect)
        for effect in hypothesis.effects
    )
    return FORM_ERROR * float(np.sqrt(max(explained, 0.0) / _stated(parameters))) if touches else 0.0


def _stated(parameters: Parameters) -> int:
    return max(sum(not part.is_of_contact for part in parameters.nominal), 1)


def _usual(share: float, stated: int) -> float:
    """The departure that this share of arms stays below."""
    return float(np.sqrt(2 * gammaincinv(stated / 2, share) / stated))
