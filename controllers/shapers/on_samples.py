"""A shaper for a digital controller: delays between samples, exactly."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxflex import ScalarLike, scalar

from .shaper import Shaper, mode

Modes = Float[Array, " modes"]


def on_samples(shaper: Shaper, sample_time: ScalarLike, frequencies: Modes, damping_ratios: Modes) -> Shaper:
    """The shaper as a filter on samples: every delay a multiple of `sample_time` [s].

    An impulse between samples is split over the `2 modes` samples about it so that each
    of the modes (`frequencies` [Hz]) is excited by the parts as it would be by the whole:
    `sum_k a_k e^(s k h) = A e^(s t)` at every pole s. What cancels a mode goes on doing so
    exactly, where rounding the delays would leave of it up to half the angle that it turns
    through in a sample, and a linear split (Murphy and Watanabe 1992) up to an eighth of
    its square. The amplitudes are then scaled to sum to one.

    The frequencies must be below half the sampling frequency.
    """
    h = scalar(sample_time)
    taps = 2 * frequencies.shape[0]
    poles = [mode(frequencies[k], damping_ratios[k]) for k in range(frequencies.shape[0])]
    rates, damped = (jnp.stack(part) * h for part in zip(*poles, strict=True))

    def waves(samples):
        growth = jnp.exp(rates[:, None] * samples)
        angles = damped[:, None] * samples
        return jnp.concatenate([growth * jnp.cos(angles), growth * jnp.sin(angles)])

    def split(amplitude, delay):
        place = delay / h
        first = jnp.maximum(jnp.floor(place + 1e-9) - (taps // 2 - 1), 0.0)
        # seen from the first of its samples, so that no wave grows out of bounds
        parts = jnp.linalg.solve(waves(jnp.arange(float(taps))), waves((place - first)[None]))[:, 0]
        return amplitude * parts, h * (first + jnp.arange(float(taps)))

    amplitudes, delays = (part.ravel() for part in jax.vmap(split)(shaper.amplitudes, shaper.delays))
    order = jnp.argsort(delays)
    return Shaper(amplitudes[order] / amplitudes.sum(), delays[order])
