"""The classical Runge-Kutta method as a solver of diffrax."""

from collections.abc import Callable
from typing import ClassVar

import diffrax
import numpy as np

_WEIGHTS = np.array([1 / 6, 1 / 3, 1 / 3, 1 / 6])


class RungeKutta4(diffrax.AbstractERK):
    """Classical Runge-Kutta method of order 4 (Kutta 1901), for `Fixed(dt, RungeKutta4())`.

    `y1 = y0 + h/6 (k1 + 2 k2 + 2 k3 + k4)`, the method of Ahmad et al. (2008), section
    IV. The slope at `y1`, which the next step needs anyhow, stands beside the four
    stages: with it in the place of k4 the weights are of order 3, so `h/6 (k4 - k5)`
    estimates the error of a step and the method serves `Adaptive` as well.
    """

    tableau: ClassVar[diffrax.ButcherTableau] = diffrax.ButcherTableau(
        c=np.array([1 / 2, 1 / 2, 1.0, 1.0]),
        a_lower=(np.array([1 / 2]), np.array([0.0, 1 / 2]), np.array([0.0, 0.0, 1.0]), _WEIGHTS),
        b_sol=np.append(_WEIGHTS, 0.0),
        b_error=np.array([0.0, 0.0, 0.0, 1 / 6, -1 / 6]),
    )
    interpolation_cls: ClassVar[Callable[..., diffrax.ThirdOrderHermitePolynomialInterpolation]] = (
        diffrax.ThirdOrderHermitePolynomialInterpolation.from_k
    )

    def order(self, terms) -> int:
        """4."""
        del terms
        return 4
