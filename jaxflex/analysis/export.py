"""A linear model as python-control knows it."""

from typing import Any

import numpy as np

from ..simulation.frames import extra
from .linear import LinearModel


def to_control(linear: LinearModel, closed: bool = False) -> Any:
    """`linear` as a `control.StateSpace` with named inputs and outputs; needs the extra `control`.

    `closed`: the model is of a loop closed by a controller. Outputs are named as channels;
    inputs of an open loop are `command_1` …, of a closed one, which has three a joint,
    `reference_1` …, `reference_rate_1` …, `reference_acceleration_1` ….

    **Raises** `ValueError` for a batch of models, `ImportError` without python-control.
    """
    kinds = ("reference", "reference_rate", "reference_acceleration") if closed else ("command",)
    control = extra("control", "control", "a StateSpace")
    a, b, c, d = (np.asarray(matrix, dtype=float) for matrix in linear[:4])
    if a.ndim != 2:
        raise ValueError(
            f"A has shape {a.shape}: one model at a time can be exported; index the batch first."
        )
    inputs = [f"{kind}_{joint + 1}" for kind in kinds for joint in range(b.shape[1] // len(kinds))]
    return control.ss(a, b, c, d, inputs=inputs, outputs=list(linear.channels), name="arm")
