"""How large what was found is, and how sure."""

# arrays of numpy go to JAX and come back, which its annotations do not foresee
# pyright: reportArgumentType=false, reportOptionalMemberAccess=false

import numpy as np

from ..files.units import parameter_unit
from ..sensors import unit
from .catalogue import FORM
from .hypothesis import Hypothesis, Search
from .parameters import EffectParameter
from .result import Estimate
from .shooting import Problem

OWN_ERROR = 0.03  # of an effect's size: what the form given to it may be wrong by
OWN_ERRORS = {"stribeck_friction": 0.2, "winding_heating": 0.15}  # where many forms are in use
FORM_ERROR = 0.3  # the same, of how friction changes its sign and fades: none of its laws is the true one
COMPONENTS = {"along_y": "along_x", "along_x": "along_y", "sine": "cosine", "cosine": "sine"}  # of one size
TIMING_ERRORS = {  # of a sample
    "input_delay": 0.05,  # a delayed command counts as its mean over each
    "sensor_lag": 0.3,  # a filter that works on samples lags by half of one more or less
}


def estimated(search: Search, hypothesis: Hypothesis) -> dict[int, Estimate]:
    """Every parameter that was free, by its place in the vector."""
    found, parameters = hypothesis.fit, search.parameters
    matrix = found.normal.matrix + np.diag(found.freedom.prior(found.vector)[2])
    scale = np.sqrt(np.clip(np.diag(matrix), 1e-300, None))
    tidy = matrix / np.outer(scale, scale)
    spread = np.full(len(matrix), np.inf)  # of a motion that was lost nothing is known
    if np.isfinite(tidy).all():
        inverse = np.linalg.pinv(tidy) / np.outer(scale, scale)
        spread = np.sqrt(np.clip(np.diag(inverse), 0, None) * max(found.level, 1.0))
    estimates = {}
    for column, std in zip(found.freedom.columns, spread, strict=True):
        value = found.vector[column]
        if column < len(parameters.nominal):
            part = parameters.nominal[column]
            size = part.value * float(np.exp(part.spread * value))
            estimates[column] = Estimate(size, size * part.spread * float(std), parameter_unit(part.name))
        else:
            part = parameters.effect[column - len(parameters.nominal)]
            whole = float(np.hypot(std, own_error(search.problem, found.vector, part)))
            estimates[column] = Estimate(float(value), whole, _unit(part.unit, part.location))
    return estimates


def own_error(problem: Problem, vector: np.ndarray, part: EffectParameter) -> float:
    """What a parameter of an effect may be wrong by without noise, in its unit: form, timing, the reading's zero."""
    setting = problem.setting

    def value(field: str) -> float:
        return float(vector[setting.parameters.position(part.effect, part.location, field)])

    share = FORM_ERROR if part.field in FORM else OWN_ERRORS.get(part.effect, OWN_ERROR)
    own = share * np.hypot(
        value(part.field), value(COMPONENTS[part.field]) if part.field in COMPONENTS else 0.0
    )
    late = TIMING_ERRORS.get(part.effect, 0.0) * setting.sample_time
    angle = f"angle_{part.location.rpartition('_')[2]}"
    counted = part.field == "rest_angle" and angle in setting.channels
    off = setting.noise[setting.channels.index(angle)] if counted else 0.0
    return float(np.sqrt(own**2 + late**2 + off**2))


def _unit(text: str, location: str) -> str:
    if not text.startswith("of the channel"):
        return text
    own = unit(location)
    return own if text == "of the channel" else f"{own}/s"
