"""What is wrong with recordings of a vibration, in sentences: what to think twice about, and what to record."""

import numpy as np

from .fit import Fit, fit_modes
from .stretches import DRIVES, Stretch

MISFIT = 3.0  # times the noise, from which on more is left than noise
WELL = 0.9  # share of the variance from which on the modes are believed to be all there is


def meant(kind: str | None) -> list[str]:
    """What the modes are of, where it is not the loop that a reference drives."""
    if kind in DRIVES:
        return [
            f"no reference is recorded, so these are the modes of the arm moved by its drive ({kind}); a position "
            "loop around it changes them. Record reference_1 to have those of the loop."
        ]
    if kind == "angle":
        return [
            "these are the modes of the links with the joint's angle given, those that ring if the joint is held "
            "stiffly. Record reference_1 to have those of the loop as it is."
        ]
    return []


def doubts(found: list[Stretch], fit: Fit, source: str) -> list[str]:
    """What to think twice about: few cycles, slow sampling, noise, damping that changes with size."""
    said = []
    first = int(np.argmax(fit.ringing))
    f = fit.frequency[first]
    cycles = f * max(s.times[-1] for s in found)
    if cycles < 5:
        said.append(
            f"{source}: only {cycles:.1f} cycles at {f:.3g} Hz; record at least five for its damping."
        )
    per_cycle = 1 / (f * found[0].step)
    if per_cycle < 8:
        said.append(f"{source}: only {per_cycle:.1f} samples a cycle at {f:.3g} Hz; sample faster.")
    if fit.explained < WELL:
        said.append(
            f"{source}: {100 * fit.explained:.0f} % of the motion is that of its modes; the rest is noise, "
            "friction or another disturbance."
        )
    if fit.damping_std[first] > 0.3 * max(fit.damping_ratio[first], 1e-3):
        said.append(
            f"{source}: the damping ratio {fit.damping_ratio[first]:.3g} is known to "
            f"+-{fit.damping_std[first]:.2g} only; record a longer or stronger vibration."
        )
    if fit.damping_ratio[first] < 0:
        said.append(
            f"{source}: the vibration at {f:.3g} Hz grows; the loop is unstable or driven by something."
        )
    if fit.misfit > MISFIT**2 and len(found[0].inputs):
        said.append(
            f"{source}: what is left is {np.sqrt(fit.misfit):.0f} times the noise: friction or another effect "
            "that is not linear, or a sensor that lags; frequency and damping are of the mean motion."
        )
    changes = _changes(found, fit, source, first)
    if fit.misfit > MISFIT and not len(found[0].inputs) and not changes:
        said.append(
            f"{source}: what rings does not die out as a free vibration does (what is left is "
            f"{np.sqrt(fit.misfit):.0f} times the noise): it rubs, or something that is not recorded drives it. "
            "Record reference_1 with it, or a decay after all has stopped."
        )
    return said + changes


def _changes(found: list[Stretch], fit: Fit, source: str, first: int) -> list[str]:
    """A word where frequency or damping of the largest mode differs between early and late in the decays."""
    f, zeta = fit.frequency[first], max(fit.damping_ratio[first], 1e-3)
    if len(found[0].inputs):
        return []
    early, late = [], []
    for stretch in found:
        # each half is as long as the vibration takes to fall to a third, but three cycles at least
        half = int(max(1.1 / (2 * np.pi * f * zeta), 3 / f) / stretch.step)
        half = min(half, stretch.outputs.shape[1] // 2)
        if half * stretch.step * f < 2:
            return []
        for parts, start in ((early, 0), (late, half)):
            window = stretch.outputs[:, start : start + half]
            parts.append(Stretch(stretch.step, window, stretch.inputs[:, :half], stretch.channels, source))
    start = np.column_stack([fit.frequency, np.clip(fit.damping_ratio, 1e-4, 0.9)]).ravel()
    before, after = (fit_modes(parts, start, np.zeros(0)) for parts in (early, late))
    said = []
    for name, a, b, da, db, share in (
        ("damping ratio", before.damping_ratio[first], after.damping_ratio[first],
         before.damping_std[first], after.damping_std[first], 0.2),
        ("frequency", before.frequency[first], after.frequency[first],
         before.frequency_std[first], after.frequency_std[first], 0.01),
    ):  # fmt: skip
        if abs(b - a) > 4 * np.hypot(da, db) and abs(b - a) > share * max(abs(a), abs(b)):
            cause = (
                "friction" if name == "damping ratio" and b > a else "a stiffness or drag that is not linear"
            )
            said.append(
                f"{source}: the {name} at {f:.3g} Hz changes with amplitude, from {a:.3g} early to {b:.3g} late "
                f"in the decay: {cause}. Both count in the spread only if recorded at both sizes."
            )
    return said
