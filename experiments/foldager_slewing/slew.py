"""Driven slewing under a profile of current (Fig. 8 to 10)."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

import controllers as ctl
import jaxflex as jf

from .models import coupled, lumped, one_way_tip, rigid, tip_from_strain

CURRENT, WIDTH, BEGIN = 0.5, 0.2, 0.1  # A, s, s: forwards, and backwards for as long
AFTER = BEGIN + 2 * WIDTH  # s
STEP, END = 5e-4, 1.5  # s
STRAIN_NOISE, ENCODER_COUNTS = 0.5e-6, 4096  # strain, standard deviation; counts a turn
TIGHT = jf.Adaptive(rtol=1e-8, atol=1e-10, stability=None)  # the link moves all the time


class Slew(NamedTuple):
    """Times [s], current [A], and by model the hub angle [rad] and tip deflection [m]."""

    times: np.ndarray
    current: np.ndarray
    angle: dict[str, np.ndarray]
    tip: dict[str, np.ndarray]


def slew(segments: int) -> Slew:
    """All models under the current; instruments read the coupled one."""
    times = jnp.arange(0.0, END + STEP / 2, STEP)

    profile = ctl.BangBang((CURRENT,), width=WIDTH, begin=BEGIN)

    def run(arm, *channels):
        return jf.simulate(arm, ctl.OpenLoop(), profile, times, method=TIGHT, channels=channels)

    beam = run(coupled("current"), "current_1", "angle_1", "rate_1", "tip_deflection_1", "strain_1")
    chain = run(lumped("current", segments), "angle_1", "tip_deflection_1")
    body = run(rigid("current"), "angle_1", "rate_1")
    t = np.asarray(times)
    gauge, encoder = jf.Sensor(noise=STRAIN_NOISE), jf.Sensor(resolution=2 * np.pi / ENCODER_COUNTS)
    strain = np.asarray(gauge.read(times, beam["strain_1"], jax.random.key(0)))
    return Slew(
        t,
        np.asarray(beam["current_1"]),
        {
            "coupled": np.asarray(beam["angle_1"]),
            "lumped": np.asarray(chain["angle_1"]),
            "one-way": np.asarray(body["angle_1"]),
            "encoder": np.asarray(encoder.read(times, beam["angle_1"])),
        },
        {
            "coupled": np.asarray(beam["tip_deflection_1"]),
            "lumped": np.asarray(chain["tip_deflection_1"]),
            "one-way": one_way_tip(t, np.asarray(body["rate_1"])),
            "one-way, measured hub": one_way_tip(t, np.asarray(beam["rate_1"])),
            "strain gauge": tip_from_strain(strain),
            "strain gauge, no noise": tip_from_strain(np.asarray(beam["strain_1"])),
        },
    )


def figures(found: Slew) -> dict:
    """How far every model is from the coupled one, and at what frequency it rings after the move."""
    after = found.times >= AFTER
    truth = found.tip["coupled"]
    span, turned = np.ptp(truth), np.ptp(found.angle["coupled"])
    told = {}
    for name, tip in found.tip.items():
        f, density = jf.spectrum(jnp.asarray(found.times[after]), jnp.asarray(tip[after]))
        told[name] = {
            "tip_rms_difference_pct_of_span": float(100 * np.sqrt(np.mean((tip - truth) ** 2)) / span),
            "largest_deflection_mm": float(1e3 * np.abs(tip).max()),
            "residual_peak_to_peak_mm": float(1e3 * np.ptp(tip[after])),
            "rings_at_hz": float(f[1 + jnp.argmax(density[1:])]),
        }
    for name, angle in found.angle.items():
        if name in told:
            off = np.sqrt(np.mean((angle - found.angle["coupled"]) ** 2))
            told[name]["angle_rms_difference_pct"] = float(100 * off / turned)
    return told
