"""What does the diagnosis find in recordings of real machines?"""

from pathlib import Path

import jaxflex as jf

from .dry import dry_torque, held_torques
from .force import force_error, least_error

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
MACHINES = ("emps", "quanser_flexible_link")
CORNERS = (8.0, 12.0, 20.0, 30.0)  # Hz
SLOWEST = (0.0, 0.5)  # rad/s
LASTING, SETTLING = 0.06, 0.03  # s


def read(machine: str) -> tuple[jf.ArmFile, jf.Recording]:
    """The arm file of a machine, and its recording."""
    return jf.read_arm_file(DATA / machine / "arm.toml"), jf.read_recording(DATA / machine / "run_1.csv")


def figures_of(found: jf.Diagnosis) -> dict:
    """What was named, what was calibrated, and the gap."""
    return {
        "verdict": found.verdict,
        "effects": {
            f"{effect.name} at {effect.location}": {
                key: [part.value, part.std, part.unit] for key, part in effect.parameters.items()
            }
            for effect in (*found.effects, *found.alternatives)
        },
        "alternatives": [effect.name for effect in found.alternatives],
        "calibrated": {key: [part.value, part.std, part.unit] for key, part in found.calibrated.items()},
        "gap_explained": found.explained,
        "after_over_before": {c: found.gap.after[c] / found.gap.before[c] for c in found.gap.before},
        "after_over_floor": {c: found.gap.after[c] / found.gap.noise_floor[c] for c in found.gap.before},
        "seconds": found.seconds,
    }


def run(folder: Path, reduced: bool) -> dict:
    """Diagnose the positioning system and the flexible link; reduced: the first alone."""
    if not DATA.is_dir():
        raise SystemExit(f"the recordings are not here: {DATA} is absent")
    figures = {}
    for machine in MACHINES[:1] if reduced else MACHINES:
        file, recording = read(machine)
        found = jf.diagnose(file, [recording])
        figures[machine] = figures_of(found)
        if "torque_1" in recording.channels and not found.improved.links:
            figures[machine]["relative_force_error"] = {
                "best inertia and viscous friction": least_error(recording),
                "with what was named": force_error(found.improved, recording),
            }
        if file.arm.links:
            held = held_torques(file.arm, recording, LASTING, SETTLING)
            figures[machine]["torques held at rest [N m]"] = held
            figures[machine]["coulomb torque by least squares [N m]"] = {
                f"from {slowest:g} rad/s": {
                    f"{corner:g} Hz": dry_torque(file.arm, recording, corner, slowest) for corner in CORNERS
                }
                for slowest in SLOWEST
            }
    return figures
