"""Driven slewing (section 6.3, Fig. 8 to 10), and motor and controller against vibration (12)."""

from pathlib import Path

import jax.numpy as jnp
import numpy as np

import jaxflex as jf

from . import pictures, slew
from .locus import (
    BAND,
    STIFFNESS,
    TIMES,
    elastic_mode,
    left_ringing,
    most_damped,
    moves,
    poles,
    vibrating,
)
from .models import (
    GAUGE,
    coupled,
    one_way,
    one_way_tip,
    open_loop,
    rigid_axis,
    step_of_coupled,
    tip_over_voltage,
)
from .transfer import deflection_after_step

PRINTED, COUNTED = "(12) as printed", "(12), link's inertia in J"
SOFT, HARD = 0.05, 5.0  # V s/rad, damping gains shown beside the best


def run(folder: Path, reduced: bool) -> dict:
    """Which model foretells a driven slew, and what do motor and controller do to the vibration?"""
    segments = 3 if reduced else 10
    slewed = slew.slew(segments)
    pictures.slewing(slewed).savefig(folder / "slewing.png", dpi=130)
    return {
        "assumed": {
            "current_A": slew.CURRENT,
            "width_s": slew.WIDTH,
            "gauge_position_m": GAUGE,
            "lumped_segments": segments,
        },
        "slewing": slew.figures(slewed),
        "transfer": transfer(folder),
        "control": control(folder, 15 if reduced else 80),
    }


def transfer(folder: Path) -> dict:
    """(12) against the coupled model, in frequency and after a step of voltage."""
    frequencies = np.linspace(0.5, 150.0, 3000)
    s = 2j * np.pi * jnp.asarray(frequencies)
    axes = {PRINTED: rigid_axis(False), COUNTED: rigid_axis(True)}
    gains = {name: np.asarray(one_way().tip_over_voltage(s, axis)) for name, axis in axes.items()}
    gains["coupled"] = tip_over_voltage(frequencies)
    times = np.linspace(0.0, 0.6, 6001)
    closed = {name: deflection_after_step(axis, times) for name, axis in axes.items()}
    integrated = {
        name: one_way_tip(times, np.asarray(axis.speed_after_step(1.0, jnp.asarray(times))))
        for name, axis in axes.items()
    }
    beam = step_of_coupled(times)
    steps = {"closed form": closed[COUNTED], "one-way": integrated[COUNTED], "coupled": beam}
    pictures.transfer(frequencies, gains, times, steps).savefig(folder / "transfer.png", dpi=130)
    low = frequencies < 60
    errors = [np.abs(closed[name] - integrated[name]).max() / np.abs(closed[name]).max() for name in axes]
    return {
        "strongest_below_60_hz": {
            name: float(frequencies[low][np.argmax(np.abs(gain[low]))]) for name, gain in gains.items()
        },
        "inverse_transform_error": float(max(errors)),
        "largest_after_1_V_mm": {
            name: float(1e3 * np.abs(tip).max()) for name, tip in {**closed, "coupled": beam}.items()
        },
    }


def control(folder: Path, points: int) -> dict:
    """Root locus against the gains of the PD, and a move under soft, best and hard damping."""
    dampings = np.geomspace(1e-2, 10.0, points)
    by_damping = poles(np.full(points, STIFFNESS), dampings)
    best = most_damped(dampings, by_damping)
    stiffnesses = np.geomspace(0.1, 1e3, points)
    by_stiffness = poles(stiffnesses, np.full(points, best["damping_V_s_rad"]))
    runs = {gain: moves(gain) for gain in (SOFT, best["damping_V_s_rad"], HARD)}
    clamped = np.asarray(jf.locked_frequencies(coupled("voltage")))
    pictures.locus(
        (dampings, by_damping), (stiffnesses, by_stiffness),
        (
            f"root locus against damping, at {STIFFNESS:g} V/rad",
            f"root locus against stiffness, at {best['damping_V_s_rad']:.2g} V s/rad",
        ),
        clamped, TIMES, runs,
    ).savefig(folder / "locus.png", dpi=130)  # fmt: skip
    shown = poles(np.full(3, STIFFNESS), np.array(list(runs)))
    lowest = shown[-1][np.abs(shown[-1]) < 2 * np.pi * BAND[0]]
    unpowered = {"no motor": "torque", "back-EMF alone": "voltage"}  # a torque drive's motor is ideal
    return {
        "stiffness_V_rad": STIFFNESS,
        "best": best,
        "elastic_mode_hz_and_ratio": {
            **{
                name: elastic_mode(np.linalg.eigvals(open_loop(drive)[0]))
                for name, drive in unpowered.items()
            },
            **{f"{gain:.3g}": elastic_mode(at) for gain, at in zip(runs, shown, strict=True)},
        },
        "lowest_mode_of_hard_hz_and_ratio": vibrating(lowest),
        "unstable_from_stiffness_V_rad": float(stiffnesses[np.argmax(by_stiffness.real.max(axis=1) > 0)]),
        "largest_real_part_against_damping": float(by_damping.real.max()),
        "ringing_left_mm": {
            f"{gain:.3g}": {"coupled": left_ringing(tips[0]), "one-way": left_ringing(tips[1])}
            for gain, tips in runs.items()
        },
    }
