"""What rings in the model of an arm under its controller, over payloads."""

from collections.abc import Sequence
from pathlib import Path

import jax.numpy as jnp
import numpy as np

from controllers import FreeMotion, default_move, step_motion, textbook_pd

from ..arm.arm import Arm
from ..arm.library import ahmad_arm
from ..files.arm_file import read_arm_file
from ..ringing import MeasuredMode
from ..ringing.measure import RINGS, SMALL
from .design_file import read_design
from .runtime import UsageError

FOLLOWED = 1.6  # ratio of frequencies at neighbouring payloads up to which a mode is the same
BUILT_IN = tuple(np.linspace(0.0, 0.1, 6).tolist())  # kg


def modes_of_arm(path: Path | None, payloads: Sequence[float] | None, count: int) -> tuple:
    """Title, modes by size with their spread over payloads, `count` frequencies [Hz], spectrum, words.

    Of the loop closed by the design in the file, or by the textbook PD for the middle
    payload, about the end of its move. The size of a mode is its share of all
    ringing of the tip after a step of the reference.
    """
    file = read_arm_file(path) if path else None
    arm = file.arm if file else ahmad_arm()
    design = read_design(file, str(path)) if file else None
    if all(link.modes == 0 for link in arm.links):
        raise UsageError(f"{path or 'the arm'}: it has no flexible link, so nothing rings.")
    masses = list(payloads or (BUILT_IN if file is None else [float(arm.payload.mass)]))
    middle = arm.with_payload(masses[len(masses) // 2])
    move = design.move if design else default_move(middle)
    stop = jnp.stack(move.stop)
    controller = design.controller if design else textbook_pd(middle, stop)
    motions = [
        step_motion(arm.with_payload(mass), controller, jnp.stack(move.start), stop) for mass in masses
    ]
    modes = _followed(arm, [_ringing(motion) for motion in motions])
    top = 1.3 * max([3 * modes[0].frequency, *(mode.frequency_range[1] for mode in modes)])
    frequencies = np.linspace(0.0, top, count)
    spectrum = np.max([_spectrum(motion, frequencies) for motion in motions], axis=0)
    law = "its design" if design else "the textbook PD"
    grams = f"{1e3 * masses[0]:g} to {1e3 * masses[-1]:g} g" if len(masses) > 1 else f"{1e3 * masses[0]:g} g"
    pose = ", ".join(f"{float(a):g}" for a in stop)
    used = (f"the model under {law}, payload {grams} ({len(masses)} value(s)), about {pose} rad",)
    return arm.name, tuple(modes), frequencies, spectrum, (), used


def _ringing(motion: FreeMotion) -> np.ndarray:
    """Frequency [Hz], damping ratio and size of every mode that rings, by frequency."""
    poles = np.asarray(motion.poles)
    size = np.linalg.norm(np.asarray(motion.tip), axis=0)
    zeta = -np.real(poles) / np.abs(poles)
    kept = (np.imag(poles) > 0) & (zeta < RINGS)
    share = size / max(size[kept].sum(), 1e-300)
    rows = np.column_stack([np.abs(poles) / (2 * np.pi), zeta, share])[kept]
    return rows[np.argsort(rows[:, 0])]


def _followed(arm: Arm, by_payload: list[np.ndarray]) -> list[MeasuredMode]:
    """Modes followed from payload to payload by the nearest frequency, by falling size."""
    chains: list[list[np.ndarray]] = []
    for rows in by_payload:
        left = list(range(len(rows)))
        for chain in chains:
            jumps = [abs(np.log(rows[i, 0] / chain[-1][0])) for i in left]
            if jumps and min(jumps) < np.log(FOLLOWED):
                chain.append(rows[left.pop(int(np.argmin(jumps)))])
        chains += [[rows[i]] for i in left]
    if not chains:
        raise UsageError(f"{arm.name}: no mode of the closed loop rings: a shaper has nothing to cancel.")
    modes = []
    for chain in chains:
        f, z, size = np.array(chain).T
        z = np.maximum(z, 0.0)
        modes.append(
            MeasuredMode(
                float((f.min() + f.max()) / 2), 0.0, float((z.min() + z.max()) / 2), 0.0,
                (float(f.min()), float(f.max())), (float(z.min()), float(z.max())),
                float(size.max()), len(chain),
            )
        )  # fmt: skip
    modes.sort(key=lambda mode: -mode.size)
    return [mode for mode in modes if mode.size >= SMALL * modes[0].size]


def _spectrum(motion: FreeMotion, frequencies: np.ndarray) -> np.ndarray:
    """Size of the Fourier transform of the ringing part of the tip's motion."""
    poles, tip = np.asarray(motion.poles), np.asarray(motion.tip)
    rings = (np.abs(np.imag(poles)) > 0) & (-np.real(poles) < RINGS * np.abs(poles))
    s = 2j * np.pi * frequencies[:, None]
    return np.linalg.norm((1 / (s - poles[rings])) @ tip[:, rings].T, axis=1)
