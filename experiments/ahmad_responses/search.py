"""The search: for every choice, the numbers that come closest to Table II."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Float

from controllers.minimise import make_stepper, minimise

from .paper import PAYLOADS, TABLE_II, measures
from .unknowns import DURATION, WIDTH, Choice, angles, domain, printed

SCALES = jnp.array([0.02, 0.02, 2.0])  # s, s, %: what counts as one unit of misfit


class Found(NamedTuple):
    """Numbers found for a choice, their misfit (rms of Table II in units of `SCALES`), and the table they give."""

    choice: Choice
    numbers: Float[Array, " numbers"]
    misfit: float
    table: np.ndarray
    final: np.ndarray


def table(choice: Choice, numbers, payloads, dt: float):
    """Measures `(joint, payload, column)` and final angles [rad] `(joint, payload)`."""
    times = jnp.linspace(0.0, DURATION, round(DURATION / dt) + 1)

    until = round(2 * WIDTH / dt) if choice.early else None

    def one(payload):
        both = angles(choice, numbers, payload, dt)
        return jnp.stack([measures(times, angle, until) for angle in both]), both[:, -1]

    rows, final = jax.vmap(one)(jnp.asarray(payloads))
    return jnp.moveaxis(rows, 0, 1), final.T


def misfit(rows, payloads) -> Array:
    """Root mean square of the differences from Table II in units of `SCALES`."""
    index = [PAYLOADS.index(p) for p in payloads]
    off = (rows - jnp.asarray(TABLE_II)[:, jnp.asarray(index)]) / SCALES
    return jnp.sqrt(jnp.mean(jnp.nan_to_num(off, nan=1e3, posinf=1e3, neginf=-1e3) ** 2))


def evaluate(choice: Choice, numbers, payloads, dt: float) -> Found:
    """What these assumptions give."""
    rows, final = jax.jit(lambda n: table(choice, n, payloads, dt))(numbers)
    value = float(misfit(rows, payloads))
    return Found(choice, numbers, value, np.asarray(rows), np.asarray(final))


def search(choice: Choice, payloads, steps: int, starts: int, dt: float, seed: int = 0) -> Found:
    """Best numbers for a choice: BFGS on the logarithm of the misfit.

    From the printed numbers and from `starts - 1` others scattered about them.
    """
    box = domain()

    def cost(free):
        rows, _ = table(choice, box.value(free), payloads, dt)
        return jnp.log(misfit(rows, payloads))

    centre = box.free(printed())
    scatter = jax.random.normal(jax.random.key(seed), (starts - 1, centre.shape[0]))
    stepper = make_stepper(cost, optx.BFGS(rtol=1e-5, atol=1e-5), centre)
    ends = [minimise(stepper, start, steps) for start in (centre, *(centre + scatter))]
    best = min(ends, key=lambda end: end.cost)
    return evaluate(choice, box.value(best.free), payloads, dt)
