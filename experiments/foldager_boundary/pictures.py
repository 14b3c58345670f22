"""The pictures of the boundary experiment."""

import jax
import numpy as np
from matplotlib.figure import Figure

from ..foldager import DRIVEN_LUMPED, DRIVEN_MEASURED
from ..pictures import MEASURED, OURS, THEIRS, figure, level
from .inference import Boundary, CoupledLink

TOP = 260.0  # Hz


def boundary(
    inertias: np.ndarray,
    stiffnesses: np.ndarray,
    dampings: np.ndarray,
    against: dict[str, np.ndarray],
    poles: np.ndarray,
    doubt: dict,
) -> Figure:
    """Driven frequencies from pinned-free to clamped, by hub inertia, by root spring and by damper."""
    made, ((by_inertia, by_stiffness, by_damping),) = figure(1, 3, height=4.4, width=12.5)
    by_inertia.semilogx(inertias, against["inertia"][:, 1:], color=OURS)
    by_inertia.axvspan(*doubt["hub_inertia_kg_m2"], color=OURS, alpha=0.15, linewidth=0)
    by_inertia.set_xlabel("hub inertia J [kg m²], root free")
    by_inertia.set_title("hub inertia: pinned-free to clamped", fontsize=10)
    by_stiffness.semilogx(stiffnesses, against["stiffness, no hub"], color="0.6", linewidth=0.9)
    by_stiffness.semilogx(stiffnesses, against["stiffness"], color=OURS)
    by_stiffness.axvspan(
        stiffnesses[0], doubt["root_stiffness_at_most_N_m"], color=OURS, alpha=0.15, linewidth=0
    )
    by_stiffness.set_xlabel("root stiffness k [N m/rad]")
    by_stiffness.set_title("root spring; grey: no hub inertia", fontsize=10)
    seen = (poles.imag > 0) & (-poles.real < 0.7 * np.abs(poles))
    across = np.broadcast_to(dampings[:, None], poles.shape)[seen]
    by_damping.semilogx(across, poles[seen].imag / (2 * np.pi), ".", color=OURS, markersize=3)
    by_damping.set_xlabel("hub damping c [N m s/rad]")
    by_damping.set_title("damper, inferred hub (ratios below 0.7)", fontsize=10)
    for axis in (by_inertia, by_stiffness, by_damping):
        axis.set_ylim(0, TOP)
        for value in DRIVEN_MEASURED:
            level(axis, value, f"measured {value:g} Hz", at=0.62)
    ends = against["inertia"]
    for row, side, offset in ((0, "left", (2, 3)), (-1, "right", (-2, 3))):
        for value in ends[row, 1:]:
            if value < TOP:
                by_inertia.annotate(
                    f"{value:.1f} Hz", (inertias[row], value), xytext=offset,
                    textcoords="offset points", fontsize=7, color=OURS, ha=side,
                )  # fmt: skip
    by_inertia.set_ylabel("natural frequency [Hz]")
    return made


def plane(link: CoupledLink, found: dict[str, dict]) -> Figure:
    """Where in the plane of hub inertia and root stiffness each driven frequency reads as measured."""
    made, axes = figure(1, len(found), height=4.0, width=10.5)
    inertias, stiffnesses = np.linspace(2e-5, 1e-4, 161), np.linspace(-3.0, 5.0, 161)
    titles = {"theory": "Young's modulus of the paper's theory", "all five": "Young's modulus fitted as well"}
    mesh = np.meshgrid(inertias, stiffnesses)
    for axis, (name, fitted) in zip(axes[0], found.items(), strict=True):
        modulus = 1e9 * fitted["youngs_modulus_GPa"]

        def frequencies(j, k, modulus=modulus):
            return link.driven(Boundary(modulus, j, k))[:2]

        grid = np.asarray(jax.jit(jax.vmap(jax.vmap(frequencies)))(*mesh))
        for mode, (value, colour) in enumerate(zip(DRIVEN_MEASURED, (OURS, THEIRS), strict=True)):
            band = [value - 0.5, value + 0.5]
            axis.contourf(1e5 * inertias, stiffnesses, grid[..., mode], band, colors=[colour], alpha=0.6)
            axis.plot([], [], color=colour, linewidth=6, alpha=0.6, label=f"reads {value:g} Hz (± 0.5 Hz)")
        axis.axhspan(stiffnesses[0], 0.0, color="0.85", zorder=0)
        axis.annotate(
            "no spring has a stiffness below zero", (0.99, 0.02), xycoords="axes fraction",
            ha="right", fontsize=8, color="0.35",
        )  # fmt: skip
        axis.plot(
            1e5 * fitted["hub_inertia_kg_m2"], fitted["root_stiffness_N_m"], "o", color=MEASURED,
            label="best fit of a spring and hub",
        )  # fmt: skip
        axis.set_title(f"{titles[name]}: {modulus / 1e9:.1f} GPa", fontsize=10)
        axis.set_xlabel("hub inertia J [10⁻⁵ kg m²]")
        axis.legend(fontsize=8, frameon=False, loc="upper left")
    axes[0, 0].set_ylabel("root stiffness k [N m/rad]")
    return made


def masses(counts: np.ndarray, far: np.ndarray, chosen: np.ndarray, middle: np.ndarray) -> Figure:
    """Frequencies of lumped chains against the number of masses."""
    made, ((left, right),) = figure(1, 2, height=4.0, width=10.5)
    left.plot(counts, far, "o-", markersize=3, color=OURS)
    for value in DRIVEN_LUMPED:
        level(left, value, f"the paper's lumped model, {value:g} Hz", THEIRS, at=0.55, below=True)
    left.set_title("masses at the far ends, no hub, the paper's theoretical beam", fontsize=10)
    right.plot(chosen, middle, "o-", markersize=3, color=OURS)
    for value in DRIVEN_MEASURED:
        level(right, value, f"measured {value:g} Hz", at=0.55, below=True)
    right.set_title("masses in the middles, inferred hub and beam", fontsize=10)
    for axis, top in ((left, TOP), (right, 160.0)):
        axis.set_xlabel("number of masses")
        axis.set_ylim(0, top)
    left.set_ylabel("natural frequency [Hz]")
    return made
