"""Input shapers: impulses that, convolved with a reference, leave a mode at rest.

Every shaper is a function of the mode, `frequency` [Hz] and `damping_ratio`, that gives a
`Shaper`; all are differentiable in both.
"""

from .extra_insensitive import ei as ei
from .file import load_shaper as load_shaper
from .on_samples import on_samples as on_samples
from .residual import insensitivity as insensitivity
from .residual import residual_curve as residual_curve
from .residual import residual_ratio as residual_ratio
from .several_modes import simultaneous as simultaneous
from .several_modes import zero_placement as zero_placement
from .shaper import Shaped as Shaped
from .shaper import Shaper as Shaper
from .shaper import convolve as convolve
from .shaper import unshaped as unshaped
from .smooth import cosine as cosine
from .smooth import half_sine as half_sine
from .smooth import matched_s_curve as matched_s_curve
from .smooth import polynomial as polynomial
from .specified_insensitivity import si as si
from .unity_magnitude import um_zv as um_zv
from .unity_magnitude import um_zvd as um_zvd
from .zero_vibration import zv as zv
from .zero_vibration import zvd as zvd
from .zero_vibration import zvdd as zvdd


def ei2(frequency, damping_ratio=0.0):
    """`ei` with two humps and a tolerance of 5 %."""
    return ei(frequency, damping_ratio, humps=2)


def ei3(frequency, damping_ratio=0.0):
    """`ei` with three humps and a tolerance of 5 %."""
    return ei(frequency, damping_ratio, humps=3)


CLASSICAL = {"ZV": zv, "ZVD": zvd, "ZVDD": zvdd, "EI": ei}
"""The four that every paper compares with."""

SHAPERS = CLASSICAL | {
    "EI, 2 humps": ei2,
    "EI, 3 humps": ei3,
    "UM-ZV": um_zv,
    "UM-ZVD": um_zvd,
    "moving average": lambda frequency, damping_ratio=0.0: polynomial(frequency, damping_ratio, 0),
    "parabola": polynomial,
    "half sine": half_sine,
    "cosine": cosine,
}
"""All shapers for one mode, by name: functions of its frequency [Hz] and damping ratio."""
