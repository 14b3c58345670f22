"""What the paper prints, and how its columns are measured."""

import jax.numpy as jnp
from jaxtyping import Array, Float

import jaxflex as jf

PAYLOADS = (0.0, 0.02, 0.04, 0.06, 0.08, 0.1)  # kg
COLUMNS = ("rise time [s]", "settling time [s]", "overshoot [%]")
TABLE_II = (  # joint, payload, column
    (
        (0.652, 1.769, 26.20),
        (0.677, 1.765, 21.18),
        (0.700, 1.760, 17.35),
        (0.721, 1.754, 14.41),
        (0.742, 1.752, 12.25),
        (0.761, 1.750, 10.57),
    ),
    (
        (1.112, 1.803, 0.22),
        (1.113, 1.802, 0.34),
        (1.115, 1.799, 0.42),
        (1.116, 1.800, 0.50),
        (1.119, 1.796, 0.58),
        (1.121, 1.798, 0.61),
    ),
)
BAND = 0.02  # of the final value, as `stepinfo` of Matlab has it


def settling_time(times: Float[Array, " times"], share: Float[Array, " times"]) -> Array:
    """Last time [s] at which `share` of the final value enters the band of 2 %, between samples."""
    excess = jnp.abs(share - 1) - BAND
    outside = excess > 0
    last = jnp.max(jnp.where(outside, jnp.arange(times.shape[0]), 0))
    after = jnp.minimum(last + 1, times.shape[0] - 1)
    fall = excess[last] - excess[after]
    part = jnp.where(fall > 0, excess[last] / jnp.where(fall > 0, fall, 1.0), 0.0)
    return times[last] + part * (times[after] - times[last])


def measures(
    times: Float[Array, " times"], angle: Float[Array, " times"], until: int | None
) -> Float[Array, "3"]:
    """Rise time, settling time [s] and overshoot [%] towards the last value of `angle`.

    With `until`, the settling time looks at the samples up to that one alone, and towards it.
    """
    share = angle / angle[-1]
    seen = slice(None) if until is None else slice(until + 1)
    return jnp.stack(
        [
            jf.rise_time(times, share, 0.0, 1.0),
            settling_time(times[seen], angle[seen] / angle[seen][-1]),
            jf.overshoot(share, 0.0, 1.0),
        ]
    )
