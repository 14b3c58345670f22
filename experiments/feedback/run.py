"""What does each feedback law do for a flexible link, in theory and on a drive with an encoder?"""

from pathlib import Path

import jax.numpy as jnp
import numpy as np

import controllers as ctl
import jaxflex as jf

from . import pictures
from .laws import HUB, PERIOD, laws, link, on_a_drive

MOVE = ctl.Move((0.0,), (0.8,), 0.35)


def measure(arm: jf.Arm, law: jf.AbstractController) -> tuple[dict[str, float], jf.Trajectory]:
    """One move under a law: what is left of it, and the margins of the loop at its end."""
    times = jnp.linspace(0.0, 1.2, 1201)
    run = jf.simulate(arm, law, MOVE, times, max_steps=500_000)
    target = jf.tip_position(arm, jnp.stack(MOVE.stop))
    found = jf.margins(arm, jnp.stack(MOVE.stop), law)
    error = np.abs(np.asarray(run["angle_1"] - run["reference_1"]))
    return {
        "residual_vibration_mm": 1e3 * float(jf.residual_vibration(times, run.tip, MOVE.end(), target)),
        "largest_joint_error_mrad": 1e3 * float(error.max()),
        "peak_voltage_V": float(jf.peak(run["voltage_1"])),
        "phase_margin_deg": float(np.rad2deg(found.phase[0])),
        "modulus_margin": float(found.modulus[0]),
        "slowest_decay_per_s": float(found.decay),
    }, run


def run(folder: Path, reduced: bool) -> dict:
    """Every law in theory and on the drive; then a feedforward learnt over repeats."""
    arm, figures, runs = link(), {"continuous": {}, "on a drive": {}}, {}
    theory, sampled = laws(None), laws(PERIOD)
    names = ("PD", "PD, strain rate", "LQG") if reduced else tuple(theory)
    for name in names:
        figures["continuous"][name], runs[name] = measure(arm, theory[name])
        figures["on a drive"][name], _ = measure(arm, on_a_drive(sampled[name]))
    interval, trials = 2e-3, 3 if reduced else 10
    held = ctl.ZeroOrderHold(theory["PD"], interval)
    model = jf.foldager_link(0.0, modes=1, hub_inertia=HUB)  # the payload is not known to it
    response = ctl.impulse_response(model, jnp.stack(MOVE.stop), held, 250)
    errors = {}
    for forgetting in (0.0, 0.3):
        gain = ctl.learning_gain(response, 0.1, forgetting)
        learned = ctl.learn(arm, held, MOVE, gain, interval, trials)
        errors[f"forgetting {forgetting:g}"] = 1e3 * learned.errors
    figures["learning_rms_joint_error_mrad"] = {name: row.tolist() for name, row in errors.items()}
    pictures.responses(runs, errors, float(MOVE.duration)).savefig(folder / "feedback.png", dpi=130)
    return figures
