"""Spectra of the end-point acceleration against payload, beside the exact frequencies."""

from pathlib import Path
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx

import controllers as ctl
import jaxflex as jf

from .paper import TABLE_III
from .pictures import plot_spectra

PAPERS_RATIO = 0.1 / (2 * np.sqrt(0.1))  # D = 0.1 sqrt(K) with a modal mass of 0.1 kg
DAMPING = {"damping of the paper": PAPERS_RATIO, "damping ratio 0.01": 0.01}
DURATION, TORQUE_ENDS, STEP = 5.0, 2.0, 1e-3  # s
HIGHEST = 45.0  # Hz, that is looked at
STANDS_OUT = 3.0  # a peak is that much higher than the valleys on both sides of it
WEAKEST = 1e-3  # of the highest peak


def accelerations(payloads, ratios, step: float) -> np.ndarray:
    """End-point accelerations [m/s^2] under the bang-bang torque, `(ratios, payloads, links, times)`."""
    times = jnp.linspace(0.0, DURATION, round(DURATION / step) + 1)

    def one(ratio, payload):
        arm = jf.ahmad_arm(payload, drive="torque", damping=ratio)
        run = jf.simulate(
            arm,
            ctl.OpenLoop(),
            ctl.BangBang((0.2, 0.2)),
            times,
            method=jf.Fixed(step, jf.RungeKutta4()),
            channels=["tip_acceleration_1", "tip_acceleration_2"],
            adjoint=diffrax.ForwardMode(),
        )
        return jnp.stack([run[f"tip_acceleration_{link}"] for link in (1, 2)])

    over = jax.vmap(jax.vmap(one, (None, 0)), (0, None))
    return np.asarray(jax.jit(over)(jnp.asarray(ratios), jnp.asarray(payloads)))


def densities(signals: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies [Hz] and densities [(m/s^2)^2/Hz] along the last axis, up to `HIGHEST`."""
    times = step * jnp.arange(signals.shape[-1])
    flat = jnp.asarray(signals.reshape(-1, signals.shape[-1]))
    f, density = jax.vmap(lambda signal: jf.spectrum(times, signal))(flat)
    shown = np.asarray(f[0]) <= HIGHEST
    return np.asarray(f[0])[shown], np.asarray(density).reshape(*signals.shape[:-1], -1)[..., shown]


def resonances(f: np.ndarray, density: np.ndarray) -> list[float]:
    """Frequencies [Hz] of the maxima that stand out from the valleys on both sides of them."""
    found = []
    for i in range(1, len(f) - 1):
        if not density[i - 1] < density[i] >= density[i + 1]:
            continue
        left, right = density[:i][::-1], density[i + 1 :]
        valleys = []
        for side in (left, right):
            higher = np.flatnonzero(side > density[i])
            valleys.append(side[: higher[0] if len(higher) else len(side)].min())
        if density[i] > max(STANDS_OUT * max(valleys), WEAKEST * density.max()):
            found.append(round(float(f[i]), 2))
    return found


def exact(payloads, shapes: str = "distal_mass_and_moment", radius=0.0) -> jnp.ndarray:
    """The four elastic frequencies [Hz] of the stretched arm with free joints, a row a payload.

    `radius` [m] of gyration of the payload about the tip.
    """
    arm = jf.ahmad_arm(0.0, mode_shapes=shapes)

    def of(mass):
        return jf.driven_frequencies(arm.with_payload(mass, mass * radius**2))[2:6]

    return jax.vmap(of)(jnp.asarray(payloads))


def gyration(payloads, column) -> float:
    """Radius of gyration [m] of a payload with which an exact frequency lies nearest to each of `column` [Hz]."""
    column = jnp.asarray(column)

    def off(radius, _):
        all_four = exact(payloads, radius=radius)
        near = jnp.argmin(jnp.abs(all_four - column[:, None]), axis=1)
        return jnp.take_along_axis(all_four, near[:, None], axis=1)[:, 0] - column

    solver = optx.LevenbergMarquardt(rtol=1e-6, atol=1e-6)
    return float(optx.least_squares(off, solver, jnp.asarray(0.02)).value)


def run(folder: Path, reduced: bool) -> dict[str, Any]:
    """Where does the end-point acceleration resonate, and how near are the paper's figures to the exact ones?"""
    grams = (0, 100) if reduced else tuple(TABLE_III)
    payloads = np.array(grams) / 1000
    step = 2e-3 if reduced else STEP
    signals = accelerations(payloads, list(DAMPING.values()), step)
    f, density = densities(signals, step)
    # the torque writes its own ripple into the spectrum of a run: peaks are read where it is over
    f_free, density_free = densities(signals[..., round(TORQUE_ENDS / step) + 1 :], step)
    frequencies = {
        "exact": np.asarray(exact(payloads)),
        "two modes of the paper's shapes": np.asarray(exact(payloads, "clamped_tip_mass")),
    }
    radius = gyration(payloads, [TABLE_III[gram][1][1] for gram in grams])
    frequencies["exact, payload with inertia"] = np.asarray(exact(payloads, radius=radius))
    peaks = {
        name: [[resonances(f_free, density_free[k, i, link]) for link in (0, 1)] for i in range(len(grams))]
        for k, name in enumerate(DAMPING)
    }
    if not reduced:
        plot_spectra(f, density[1], grams, peaks["damping ratio 0.01"], frequencies, radius).savefig(
            folder / "spectra.png", dpi=130
        )
    rows = {}
    for i, gram in enumerate(grams):
        rows[f"{gram} g"] = {
            "paper_hz": TABLE_III[gram],
            **{f"{name}_hz": np.round(values[i], 2).tolist() for name, values in frequencies.items()},
            **{f"peaks_hz, {name}": found[i] for name, found in peaks.items()},
            "paper_over_nearest_exact": [
                [
                    round(float(v / frequencies["exact"][i][np.argmin(abs(frequencies["exact"][i] - v))]), 2)
                    for v in link
                ]
                for link in TABLE_III[gram]
            ],
        }
    return {
        "payloads": rows,
        "radius_of_gyration_mm": round(1000 * radius, 1),
        "resolution_of_the_peaks_hz": round(float(f_free[1]), 3),
    }
