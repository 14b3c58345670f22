"""The search: for every choice, the numbers that come closest to Table II."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Float

from controllers import Stepper, minimise

from .paper import PAYLOADS, TABLE_II, measures
from .unknowns import DURATION, WIDTH, Choice, angles, domain, printed

SCALES = jnp.array([0.02, 0.02, 2.0])  # s, s, %: what counts as one unit of misfit


class Found(NamedTuple):
    """Numbers found for a choice, their misfit (rms of Table II in units of `SCALES`), the table they give, and
    the joint angles [rad] behind it, `(payloads, joints, times)`."""

    choice: Choice
    numbers: Float[Array, " numbers"]
    misfit: float
    table: np.ndarray
    curves: np.ndarray


def responses(choice: Choice, numbers, payloads, dt: float) -> Array:
    """Joint angles [rad], shape `(payloads, joints, times)`."""
    return jax.vmap(lambda payload: angles(choice, numbers, payload, dt))(jnp.asarray(payloads))


def table(curves, dt: float, early: bool) -> Array:
    """Measures of joint angles, `(joint, payload, column)`."""
    times = jnp.linspace(0.0, DURATION, round(DURATION / dt) + 1)
    until = round(2 * WIDTH / dt) if early else None
    return jax.vmap(jax.vmap(lambda angle: measures(times, angle, until)), 1)(curves)


def misfit(rows, payloads) -> Array:
    """Root mean square of the differences from Table II in units of `SCALES`."""
    index = [PAYLOADS.index(p) for p in payloads]
    off = (rows - jnp.asarray(TABLE_II)[:, jnp.asarray(index)]) / SCALES
    return jnp.sqrt(jnp.mean(jnp.nan_to_num(off, nan=1e3, posinf=1e3, neginf=-1e3) ** 2))


def evaluate(choice: Choice, numbers, payloads, dt: float) -> list[Found]:
    """What these assumptions give, with both readings of the settling time."""
    readings = [choice._replace(early=early) for early in (False, True)]
    curves = jax.jit(lambda n: responses(choice, n, payloads, dt))(numbers)
    found = []
    for reading in readings:
        rows = table(curves, dt, reading.early)
        off = float(misfit(rows, payloads))
        found.append(Found(reading, numbers, off, np.asarray(rows), np.asarray(curves)))
    return found


def search(choice: Choice, payloads, steps: int, starts: int, dt: float, seed: int = 0) -> Array:
    """Best numbers for a choice: BFGS on the logarithm of the misfit.

    From the printed numbers and from `starts - 1` others scattered about them.
    """
    box = domain()

    def cost(free, args):
        curves = responses(choice, box.value(free), payloads, dt)
        return jnp.log(misfit(table(curves, dt, choice.early), payloads)), None

    centre = box.free(printed())
    scatter = jax.random.normal(jax.random.key(seed), (starts - 1, centre.shape[0]))
    stepper = Stepper(cost, optx.BFGS(rtol=1e-5, atol=1e-5))
    ends = [minimise(stepper, start[None], steps)[0] for start in (centre, *(centre + scatter))]
    best = min(ends, key=lambda end: end.cost)
    return box.value(best.free)
