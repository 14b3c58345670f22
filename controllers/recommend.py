"""Every shaper for the modes of an arm, what each leaves over their spread, and which to take."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxflex import MeasuredMode, kept

from .shapers import SHAPERS, Shaper, convolve, residual_ratio, si, simultaneous, zv, zvd

SECOND = 0.1  # size of a second mode, relative to the first, from which shapers for both are looked at
ALTERNATING = ("UM-ZV", "UM-ZVD")  # ask the drive for twice the acceleration: listed, not recommended
ALTERNATING_UP_TO = 0.7  # damping ratio
GRID = (81, 5)  # frequencies and damping ratios of the spread that are looked at
NEAR = 0.01  # relative difference in time or residual that does not count

CALLS = {
    "ZV": "ctl.zv({f}, {z})",
    "ZVD": "ctl.zvd({f}, {z})",
    "ZVDD": "ctl.zvdd({f}, {z})",
    "EI": "ctl.ei({f}, {z})",
    "EI, 2 humps": "ctl.ei({f}, {z}, humps=2)",
    "EI, 3 humps": "ctl.ei({f}, {z}, humps=3)",
    "UM-ZV": "ctl.um_zv({f}, {z})",
    "UM-ZVD": "ctl.um_zvd({f}, {z})",
    "moving average": "ctl.polynomial({f}, {z}, 0)",
    "parabola": "ctl.polynomial({f}, {z})",
    "half sine": "ctl.half_sine({f}, {z})",
    "cosine": "ctl.cosine({f}, {z})",
    "ZV x ZV": "ctl.convolve(ctl.zv({f}, {z}), ctl.zv({f2}, {z2}))",
    "ZVD x ZVD": "ctl.convolve(ctl.zvd({f}, {z}), ctl.zvd({f2}, {z2}))",
    "two modes together": "ctl.simultaneous(jnp.array([{f}, {f2}]), jnp.array([{z}, {z2}]))",
}


class Rated(NamedTuple):
    """A shaper and what it does: by how long it delays [s], and what it leaves.

    `by_mode`: the worst residual of each mode over its spread; `worst`: of all modes
    together, each counted by its size. `call` is the line of Python that makes it.
    """

    name: str
    shaper: Shaper
    added_time: float
    by_mode: tuple[float, ...]
    worst: float
    call: str


@kept
def _worst(shaper: Shaper, frequency: Float[Array, "2"], damping_ratio: Float[Array, "2"]) -> Array:
    """The largest residual over a rectangle of frequencies [Hz] and damping ratios."""
    f = jnp.linspace(frequency[0], frequency[1], GRID[0])
    z = jnp.linspace(damping_ratio[0], damping_ratio[1], GRID[1])
    return jax.vmap(lambda a: jax.vmap(lambda b: residual_ratio(shaper, a, b))(z))(f).max()


def rate_shapers(modes: Sequence[MeasuredMode], tolerance: float = 0.05) -> list[Rated]:
    """All shapers for the first of `modes`, and for the first two where the second counts, by added time.

    Designed for the middle of the measured spread; SI for a band that holds it at
    `tolerance`.
    """
    first = modes[0]
    f, z = first.frequency, min(first.damping_ratio, 0.9)
    written = {"f": f"{f:.6g}", "z": f"{z:.4g}"}
    made: dict[str, tuple[Callable[[], Shaper], str]] = {
        name: (lambda make=make: make(jnp.asarray(f), jnp.asarray(z)), CALLS[name].format(**written))
        for name, make in SHAPERS.items()
        if name not in ALTERNATING or z <= ALTERNATING_UP_TO
    }
    width = 2 * max(abs(edge / f - 1) for edge in first.frequency_range)
    width = min(max(round(width + 0.005, 2), 0.1), 0.9)
    share = min(max(tolerance, 0.01), 0.5)
    made["SI"] = (
        lambda: si(jnp.asarray(f), jnp.asarray(z), width, share),
        f"ctl.si({written['f']}, {written['z']}, {width:g}, {share:g})",
    )
    if len(modes) > 1 and modes[1].size > SECOND * first.size:
        f2, z2 = modes[1].frequency, min(modes[1].damping_ratio, 0.9)
        written |= {"f2": f"{f2:.6g}", "z2": f"{z2:.4g}"}
        both = jnp.array([f, f2]), jnp.array([z, z2])
        for name, make in {
            "ZV x ZV": lambda: convolve(zv(f, z), zv(f2, z2)),
            "ZVD x ZVD": lambda: convolve(zvd(f, z), zvd(f2, z2)),
            "two modes together": lambda: simultaneous(*both),
        }.items():
            made[name] = (make, CALLS[name].format(**written))
    rated = []
    for name, (make, call) in made.items():
        try:
            shaper = make()
        except ValueError:  # of unity magnitude there is none for a mode that hardly rings
            if name not in ALTERNATING:
                raise
        else:
            rated.append(_rate(name, shaper, call, modes))
    return sorted(rated, key=lambda r: r.added_time)


def _rate(name: str, shaper: Shaper, call: str, modes: Sequence[MeasuredMode]) -> Rated:
    by_mode = []
    for mode in modes:
        damping = jnp.clip(jnp.asarray(mode.damping_range), 0.0, 0.95)
        by_mode.append(float(_worst(shaper, jnp.maximum(jnp.asarray(mode.frequency_range), 1e-6), damping)))
    whole = sum(mode.size for mode in modes)
    worst = sum(mode.size * left for mode, left in zip(modes, by_mode, strict=True)) / whole
    return Rated(name, shaper, float(shaper.duration()), tuple(by_mode), worst, call)


def recommend(rated: Sequence[Rated], tolerance: float = 0.05) -> tuple[Rated, str]:
    """The shaper to take, of positive impulses, and why, in a sentence.

    The shortest that leaves no more than `tolerance`; where none does, the one that
    leaves least, the shorter of two that leave the same.
    """
    allowed = [r for r in rated if r.name not in ALTERNATING]
    good = [r for r in allowed if r.worst <= tolerance * (1 + 1e-6)]
    if good:
        shortest = min(r.added_time for r in good)
        best = min((r for r in good if r.added_time <= (1 + NEAR) * shortest), key=lambda r: r.worst)
        why = (
            f"{best.name} is the shortest that leaves at most {100 * tolerance:g} % over the whole spread: "
            f"{100 * best.worst:.2g} %, for {1e3 * best.added_time:.3g} ms more."
        )
        shorter = [r for r in allowed if r.added_time < best.added_time * (1 - NEAR)]
        if shorter:
            near = min(shorter, key=lambda r: r.worst)
            why += (
                f" Of the shorter ones {near.name} leaves least, {100 * near.worst:.2g} % for "
                f"{1e3 * near.added_time:.3g} ms."
            )
        return best, why
    least = min(r.worst for r in allowed)
    best = min((r for r in allowed if r.worst <= (1 + NEAR) * least), key=lambda r: r.added_time)
    why = (
        f"no shaper leaves {100 * tolerance:g} % or less over the whole spread; {best.name} leaves least, "
        f"{100 * best.worst:.2g} %, for {1e3 * best.added_time:.3g} ms more. A narrower spread (fewer payloads "
        "at a time, or more recordings) or tuned gains (jaxflex tune) would do better."
    )
    return best, why
