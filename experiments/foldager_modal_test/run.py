"""The modal test of the link by hammer and strain gauge (section 6.2, Table 1)."""

from pathlib import Path

import numpy as np

import jaxflex as jf

from ..pictures import MEASURED, OURS, figure
from .hammer import AFTER_BLOW, Record, strike
from .identify import HIGH, LOW, Peak, frequency_response, peaks
from .rig import DAMPING, GAUGE, MODELS, STIFFNESS, Rig

BLOWS = 5
SUPPORTS = ("clamped", "pinned", "driven")


def run(folder: Path, reduced: bool) -> dict:
    """What does a hammer test find of the link clamped, pinned and held by its motor?"""
    models = ("coupled",) if reduced else tuple(MODELS)
    found, shown = {}, {}
    for model in models:
        found[model] = {}
        for support in SUPPORTS:
            rig = Rig(model, support)
            record = strike(rig, BLOWS)
            lines, response, coherence = frequency_response(record)
            picked = peaks(lines, response, coherence)
            frequencies, ratios = rig.modes(LOW, HIGH)
            found[model][support] = {
                "picked_hz": [peak.frequency for peak in picked],
                "picked_damping_ratio": [peak.damping_ratio for peak in picked],
                "poles_hz": frequencies.tolist(),
                "poles_damping_ratio": ratios.tolist(),
            }
            if model == "coupled":
                shown[support] = (rig, record, lines, response, picked)
    draw_blow(shown["driven"][1]).savefig(folder / "blow.png", dpi=130)
    draw_responses(shown).savefig(folder / "responses.png", dpi=130)
    theory = jf.foldager_link(hub_inertia=0.0, modes=6)
    return {
        "assumed": {
            "gauge_position_m": GAUGE,
            "pd_stiffness_V_rad": STIFFNESS,
            "pd_damping_V_s_rad": DAMPING,
            "modal_damping_ratio": float(theory.links[0].damping_ratio[0]),
        },
        "theory_hz": {
            "clamped": jf.locked_frequencies(theory)[:3].tolist(),
            "pinned": jf.driven_frequencies(theory)[1:4].tolist(),
        },
        "tests": found,
    }


def draw_blow(record: Record):
    """One blow as force sensor and strain gauge record it."""
    made, ((force, strain),) = figure(1, 2, height=2.6)
    early = record.times < AFTER_BLOW
    force.plot(1e3 * record.times[early], record.force[0, early], ".-", color=OURS, linewidth=0.8)
    force.set_xlabel("time [ms]")
    force.set_ylabel("hammer force [N]")
    first = record.times < 0.6
    strain.plot(record.times[first], 1e6 * record.strain[0, first], color=OURS, linewidth=0.7)
    strain.set_xlabel("time [s]")
    strain.set_ylabel("strain [10⁻⁶]")
    strain.set_title("driven: the link rings on a slow swing of the whole", fontsize=10)
    return made


def draw_responses(shown: dict[str, tuple[Rig, Record, np.ndarray, np.ndarray, list[Peak]]]):
    """The response of every support, picked modes with their Hz and damping."""
    made, axes = figure(len(shown), 1, height=2.5)
    titles = {"clamped": "clamped", "pinned": "pinned-free", "driven": "held by the motor under its PD"}
    for axis, (support, (rig, _, lines, response, picked)) in zip(axes[:, 0], shown.items(), strict=True):
        inside = (lines > 1.0) & (lines < HIGH)
        axis.semilogy(
            lines[inside],
            1e6 * np.abs(response[inside]),
            color="0.65",
            linewidth=0.7,
            label="from five noisy blows",
        )
        fine = np.geomspace(1.0, HIGH, 1200)
        axis.semilogy(fine, 1e6 * np.abs(rig.response(fine)), color=OURS, linewidth=1.0, label="exact")
        for peak in picked:
            height = 1e6 * np.abs(rig.response(np.array([peak.frequency]))[0])
            axis.plot(peak.frequency, height, "v", color=MEASURED, markersize=5)
            axis.annotate(
                f"{peak.frequency:.1f} Hz, {100 * peak.damping_ratio:.1f} %", (peak.frequency, height),
                xytext=(5, 3), textcoords="offset points", fontsize=8, color=MEASURED,
            )  # fmt: skip
        axis.set_title(titles[support], fontsize=10, loc="left")
        axis.set_ylabel("strain / force [10⁻⁶/N]")
        axis.margins(y=0.15)
    axes[0, 0].legend(fontsize=8, frameon=False, loc="upper right")
    axes[-1, 0].set_xlabel("frequency [Hz]; percentages are damping ratios")
    return made
