"""One arm in two programs: where they agree, and where small deflections end."""

from pathlib import Path
from typing import Any

import numpy as np

from .arms import two_links
from .large import EXUDYN, PLAIN, STIFF, pace, pushed, shaken, spun
from .pictures import plot_small, plot_spin, plot_validity
from .small import frequencies, motions, refinement

TENTH = 0.1  # share of the length beyond which the library does not ask to be believed


def run(folder: Path, reduced: bool) -> dict[str, Any]:
    """Does the arm move as geometrically exact beams do, and up to which deflection and speed?"""
    elements = 20 if reduced else 40
    payloads = [0.05] if reduced else [0.0, 0.05, 0.1]
    table = frequencies(60, payloads, (2,) if reduced else (1, 2))
    small = motions(elements, payloads)
    swings = [0.012] if reduced else [0.001, 0.002, 0.004, 0.007, 0.012, 0.02]
    ratios = [0.3, 1.5] if reduced else [0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.75, 0.9, 1.2, 1.5, 2.0]
    pushes = [] if reduced else [0.05, 0.1, 0.2, 0.4, 0.6, 0.8]
    shakes, moves = shaken(swings, elements), pushed(pushes, elements)
    spins = [spun(ratio, elements) for ratio in ratios]
    plot_small(dict(list(small.items())[-2:])).savefig(folder / "small.png", dpi=130)
    if not reduced:
        plot_validity(shakes, moves, spins, TENTH).savefig(folder / "validity.png", dpi=130)
        plot_spin(spins, (0.3, 0.9, 1.5)).savefig(folder / "spin.png", dpi=130)

    f = spins[0].at_rest
    large = {
        what: [
            {
                "deflection_share_pct": _percent(case[PLAIN].deflection_share()),
                "hub_speed_over_first": round(case[PLAIN].hub_speed(first), 3),
                **{
                    f"tip_error_pct_of_arm, {name}": _percent(case[name].tip_error(reach))
                    for name in (PLAIN, STIFF)
                },
            }
            for case in cases
        ]
        for what, reach, cases, first in (
            ("one link shaken", 0.5, shakes, f),
            ("two links pushed", 1.0, moves, pace(two_links(0.05))),
        )
    }
    figures: dict[str, Any] = {
        "frequencies": table,
        "worst_frequency_difference_pct": max(
            abs(v) for case in table.values() for v in case["difference_pct"]
        ),
        "frequency_difference_pct_by_elements": refinement((20, 40, 80)),
        "small_motion": {
            name: {
                "tip_error_pct_of_span": _percent(pair.tip_error()),
                "deflection_share_pct": _percent(pair.deflection_share()),
            }
            for name, pair in small.items()
        },
        "large_motion": large,
        "spin": [
            {
                "hub_speed_over_first": spin.ratio,
                **{name: _round(spin.frequency[name]) for name in spin.frequency},
            }
            for spin in spins
        ],
    }
    if not reduced:
        shares = [case[PLAIN].deflection_share() for case in shakes]
        errors = {name: [case[name].tip_error(0.5) for case in shakes] for name in (PLAIN, STIFF)}
        ratio = {
            name: [abs(spin.frequency[name] / spin.frequency[EXUDYN] - 1) for spin in spins]
            for name in (PLAIN, STIFF)
        }
        figures["validity"] = {
            name: {
                "tip_error_pct_at_a_tenth": _percent(_interpolate(TENTH, shares, errors[name])),
                "deflection_share_pct_at_1_pct_tip_error": _percent(_interpolate(0.01, errors[name], shares)),
                "hub_speed_over_first_at_1_pct_frequency": _round(_interpolate(0.01, ratio[name], ratios)),
                "worst_frequency_difference_pct": _percent(max(ratio[name])),
            }
            for name in (PLAIN, STIFF)
        }
    return figures


def _interpolate(at, xs, ys) -> float:
    """`y` where `x` is `at`, between points on logarithmic scales; NaN outside of them."""
    xs, ys = np.asarray(xs), np.asarray(ys)
    known = np.isfinite(xs) & np.isfinite(ys)
    x, y = np.log(xs[known]), np.log(ys[known])
    return float(np.exp(np.interp(np.log(at), x, y, left=np.nan, right=np.nan)))


def _percent(value: float) -> float | None:
    return _round(100 * value)


def _round(value: float) -> float | None:
    """Four figures; None where there is none, as JSON wants it."""
    return float(f"{value:.4g}") if np.isfinite(value) else None
