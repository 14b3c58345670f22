"""Modes of vibration from recordings, how sure they are, and what is wrong with the data."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..files.recording import Recording, RecordingError
from .choose import least_gain, next_pole
from .doubts import MISFIT, WELL, doubts, meant
from .fit import Fit, fit_modes, poles_of
from .poles import first_poles
from .stretches import INPUTS, Stretch, common_inputs, later, stretches

MODES = 4  # of a recording, at most
SMALL = 0.02  # share of the motion below which a mode is left out
FAST = 0.45  # frequency, times the sample time, up to which a mode is told from the sampling
RINGS = 0.6  # damping ratio above which nothing rings
SIGMAS = 2.0  # standard deviations that a spread reaches to either side
MET = 1.5  # times the noise, up to which no more is left than noise
LATER = (0.25, 1.0, 4.0)  # cycles after which a decay may begin in earnest
HEARD = 0.1  # share of the variance that the modes have to explain
SAME = 0.25  # relative difference in frequency within which modes of two recordings are the same


@dataclass(frozen=True)
class MeasuredMode:
    """One mode: the mean over the recordings, its standard deviation, and the spread.

    `frequency` [Hz] is the undamped one; `frequency_range`, `damping_range` hold every
    recording's estimate with two standard deviations to either side; `size` is the
    largest excursion of the mode as a share of all motion of its channel; of a run that is driven
    throughout, the mode's share of all ringing after a step of the input.
    """

    frequency: float
    frequency_std: float
    damping_ratio: float
    damping_std: float
    frequency_range: tuple[float, float]
    damping_range: tuple[float, float]
    size: float
    recordings: int


@dataclass(frozen=True)
class MeasuredModes:
    """`modes` by falling size, `warnings` in sentences, and what was used of each recording."""

    modes: tuple[MeasuredMode, ...]
    warnings: tuple[str, ...]
    used: tuple[str, ...]
    stretches: tuple[Stretch, ...]


def measure_modes(recordings: Sequence[Recording], driven_by: str | None = None) -> MeasuredModes:
    """Frequencies and damping ratios of all modes that ring in `recordings`.

    Strain, tip deflection and tip acceleration are looked at; all such channels of a
    recording share their modes. Where the input stands still the free decay is fitted,
    else output and input together. `driven_by` says which kind of channel is the input
    (`reference`, `voltage`, `torque`, `current`, `angle`), and so what the modes are of:
    the closed loop, the arm moved by its drive, the links with the joint's motion given.
    Without it the reference is, where it is recorded; else the drive; and the angle where
    the drive explains little. A recording that shows none is left out, with a word.

    **Raises** `RecordingError` where no recording shows vibration, or one has no such input.
    """
    if driven_by is not None and driven_by not in INPUTS:
        raise RecordingError(f"driven_by = {driven_by!r} is unknown; allowed are {', '.join(INPUTS)}.")
    kinds = [driven_by] if driven_by else common_inputs(recordings)
    best = min((_tried(recordings, kind) for kind in kinds), key=lambda trial: trial.doubt)
    if not best.found:
        raise best.silent[0]
    warnings = [f"{recording.source}: {repair}" for recording in recordings for repair in recording.repairs]
    if any(len(part.inputs) for _, found, _ in best.found for part in found):
        warnings += meant(best.kind)
    used, parts = [], []
    for source, found, fit in best.found:
        warnings += doubts(found, fit, source)
        used.append(_said(found, source))
        parts += found
    warnings += [f"left out: {error}" for error in best.silent]
    modes, apart = _gathered([fit for _, _, fit in best.found])
    return MeasuredModes(tuple(modes), tuple(warnings + apart), tuple(used), tuple(parts))


@dataclass(frozen=True)
class _Trial:
    """All recordings with one kind of input: name, stretches and modes of each, and why some show none."""

    kind: str | None
    found: list[tuple[str, list[Stretch], Fit]]
    silent: list[RecordingError]

    @property
    def doubt(self) -> tuple[int, float]:
        """How many show none, and how far the others are from being explained."""
        misfits = [max(fit.misfit / MISFIT, 1.0) for _, _, fit in self.found]
        return len(self.silent), float(np.mean(np.log(misfits))) if misfits else 0.0


def _tried(recordings: Sequence[Recording], kind: str | None) -> _Trial:
    found, silent = [], []
    for recording in recordings:
        try:
            pieces, fit = _from_the_start(stretches(recording, kind), recording.source)
            found.append((recording.source, pieces, fit))
        except RecordingError as error:
            silent.append(error)
    return _Trial(kind, found, silent)


def _from_the_start(found: list[Stretch], source: str) -> tuple[list[Stretch], Fit]:
    """The modes; of free decays, if something else is seen to go on at first, from some cycles later on."""
    fit = _modes_of(found, source)
    if fit.misfit < MET or fit.explained < 0.5 or len(found[0].inputs):
        return found, fit
    for cycles in LATER:
        rest = later(found, cycles)
        if not rest:
            break
        try:
            after = _modes_of(rest, source)
        except RecordingError:
            break
        if after.misfit < MET and after.explained > WELL:
            return rest, after
    return found, fit


def _modes_of(found: list[Stretch], source: str) -> Fit:
    """The modes of one recording: candidates by realisation, the small ones dropped, the rest fitted."""
    poles = first_poles(found)
    nyquist = np.pi / found[0].step
    longest = max(s.times[-1] for s in found)
    damping = -np.real(poles) / np.maximum(np.abs(poles), 1e-300)
    rings = (
        (np.imag(poles) > 0) & (damping < RINGS) & (damping > -0.05) & (np.abs(poles) < FAST * 2 * nyquist)
    )
    rings &= np.abs(poles) * longest > 2 * np.pi  # a full turn within the data
    alone = (np.abs(np.imag(poles)) < 1e-9) & (np.real(poles) < -0.5 / longest)
    real = np.real(poles)[alone & (np.real(poles) > -nyquist / 3)]
    slow = real[np.argsort(-real)][:2] if len(found[0].inputs) else real[:0]
    fit = _grown(found, poles[rings], slow)
    if fit is None:
        raise RecordingError(
            f"{source}: nothing rings: no mode with a damping ratio below {RINGS:g} was found; record a "
            "longer decay, or excite the arm more."
        )
    for _ in range(2 * MODES):
        keep = _worth(fit, FAST / found[0].step)
        if keep.all():
            break
        if not keep.any():
            raise RecordingError(f"{source}: nothing rings above the noise; excite the arm more.")
        fit = fit_modes(found, fit.modes.reshape(-1, 2)[keep].ravel(), slow)
    if fit.explained < HEARD:
        raise RecordingError(
            f"{source}: nothing rings above the noise: modes explain {100 * fit.explained:.0f} % of the "
            f"motion, at least {100 * HEARD:.0f} % are needed; excite the arm more."
        )
    return fit


def _grown(found: list[Stretch], candidates: np.ndarray, slow: np.ndarray) -> Fit | None:
    """A mode more at a time, each fitted together with those before, as long as they explain more than noise."""
    fit = None
    while fit is None or len(fit.frequency) < MODES + 2:
        there = slow if fit is None else np.concatenate([slow, poles_of(fit.modes)])
        pole = next_pole(found, candidates, there)
        if not len(pole):
            break
        more = np.array([np.abs(pole[0]) / (2 * np.pi), -np.real(pole[0]) / np.abs(pole[0])])
        more = np.concatenate([[] if fit is None else fit.modes, more])
        grown = fit_modes(found, more, slow)
        if fit is not None and 1 - grown.misfit / fit.misfit < least_gain(grown.added, grown.samples):
            break
        fit = grown
    return fit


def _worth(fit: Fit, highest: float) -> np.ndarray:
    """Which modes to keep: below `highest` [Hz], large enough, known well, ringing, and the `MODES` largest."""
    sizes = np.where((fit.damping_ratio < RINGS) & (fit.frequency < highest), fit.size, 0.0)
    sizes = np.where(fit.frequency_std < 0.1 * fit.frequency, sizes, 0.0)
    unsure = fit.damping_std > 0.5 * np.maximum(fit.damping_ratio, 0.0)
    sizes = np.where(unsure & (sizes < sizes.max()), 0.0, sizes)
    width = fit.damping_ratio * fit.frequency
    for i in np.argsort(-sizes):
        # a vibration that changes as it dies looks like several at one frequency
        close = np.abs(fit.frequency - fit.frequency[i]) < 2 * np.abs(width + width[i])
        sizes = np.where(close & (sizes < sizes[i]), 0.0, sizes)
    keep = sizes >= max(SMALL, np.sort(sizes)[-MODES] if len(sizes) > MODES else 0.0)
    if keep.all() or not keep.any():
        return keep
    # one at a time: others may change once it is gone
    worst = np.argmin(np.where(keep, np.inf, sizes))
    return np.arange(len(sizes)) != worst


def _gathered(fits: list[Fit]) -> tuple[list[MeasuredMode], list[str]]:
    """The modes of all recordings, those of like frequency as one, by falling size."""
    groups: list[list[tuple[Fit, int]]] = []
    order = sorted(
        ((fit, k) for fit in fits for k in range(len(fit.frequency))), key=lambda p: -p[0].ringing[p[1]]
    )
    for fit, k in order:
        for group in groups:
            other, j = group[0]
            near = abs(fit.frequency[k] / other.frequency[j] - 1) < SAME
            if near and all(member is not fit for member, _ in group):
                group.append((fit, k))
                break
        else:
            groups.append([(fit, k)])
    modes, said = [], []
    for group in groups:
        f = np.array([fit.frequency[k] for fit, k in group])
        z = np.array([fit.damping_ratio[k] for fit, k in group])
        df = np.array([fit.frequency_std[k] for fit, k in group])
        dz = np.array([fit.damping_std[k] for fit, k in group])
        mean_f, std_f = _mean(f, df)
        mean_z, std_z = _mean(z, dz)
        modes.append(
            MeasuredMode(
                mean_f, std_f, max(mean_z, 0.0), std_z,
                (float(np.min(f - SIGMAS * df)), float(np.max(f + SIGMAS * df))),
                (float(max(np.min(z - SIGMAS * dz), 0.0)), float(max(np.max(z + SIGMAS * dz), 0.0))),
                float(max(fit.ringing[k] for fit, k in group)), len(group),
            )
        )  # fmt: skip
        if np.ptp(f) > 4 * np.max(df) and np.ptp(f) > 0.01 * mean_f:
            said.append(
                f"the recordings put one mode from {f.min():.4g} to {f.max():.4g} Hz, more than their noise "
                "explains: a change of payload, pose or amplitude. The spread holds them all."
            )
    return modes, said


def _mean(values: np.ndarray, stds: np.ndarray) -> tuple[float, float]:
    """The middle of the range of estimates, and the larger of its scatter and its stated deviation."""
    scatter = float(np.std(values, ddof=1)) if len(values) > 1 else 0.0
    return float((values.min() + values.max()) / 2), max(scatter, float(np.max(stds)))


def _said(found: list[Stretch], source: str) -> str:
    channels = ", ".join(found[0].channels)
    seconds = sum(s.times[-1] for s in found)
    if len(found[0].inputs):
        return f"{source}: {channels} over {seconds:.3g} s, driven throughout: fitted together with the input"
    return f"{source}: {channels} in {len(found)} free decay(s), {seconds:.3g} s in all"
