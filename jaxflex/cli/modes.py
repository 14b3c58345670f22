"""`jaxflex modes`: natural frequencies and damping against payload."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from controllers import textbook_pd

from ..analysis.frequencies import clamped_frequencies, driven_frequencies, locked_frequencies
from ..analysis.linear import closed_loop_modes, linearise
from ..arm.arm import Arm
from ..arm.library import ahmad_arm
from ..files.arm_file import load_arm
from ..plotting import plot_modes
from .runtime import console, make_folder, parse_numbers, parse_payloads
from .tables import Table, number, write_json


def modes(
    arm_file: Path | None, payloads: str | None, pose: str | None, json: Path | None, output: Path | None
) -> None:
    """Compute, print, draw and write."""
    arm = load_arm(arm_file) if arm_file else ahmad_arm()
    joints = len(arm.joints)
    masses = (
        [float(arm.payload.mass)] if payloads is None and arm_file else parse_payloads(payloads or "0:0.1:6")
    )
    angles = jnp.asarray(parse_numbers(pose, "--pose", joints) if pose else [0.0] * joints)

    def of_payload(mass):
        loaded = arm.with_payload(mass)
        clamped = tuple(clamped_frequencies(loaded, i) for i in range(len(arm.links)))
        return driven_frequencies(loaded, angles), locked_frequencies(loaded, angles), clamped

    driven, locked, clamped = jax.jit(jax.vmap(of_payload))(jnp.asarray(masses))
    words = f"{arm.name}, pose {', '.join(f'{float(a):g}' for a in angles)} rad"
    console.print(f"[bold]{words}[/]")
    families = {"joints free (driven)": np.asarray(driven), "joints locked": np.asarray(locked)}
    for i, values in enumerate(clamped, 1):
        families[f"link {i} clamped"] = np.asarray(values)
    for title, values in families.items():
        if values.shape[1] == 0:
            continue
        table = Table(
            f"{title}: natural frequencies [Hz]",
            ["payload [g]", *(f"mode {j + 1}" for j in range(values.shape[1]))],
        )
        for mass, row in zip(masses, values, strict=True):
            table.rows.append([f"{1e3 * mass:.0f}", *(number(float(f), 4) for f in row)])
        console.print(table.rich())
    console.print(_controlled(arm, angles).rich())
    if json:
        write_json(
            json,
            {
                "payloads": masses,
                "pose": angles.tolist(),
                "driven_hz": np.asarray(driven).tolist(),
                "locked_hz": np.asarray(locked).tolist(),
                "clamped_hz": [[np.asarray(c)[k].tolist() for c in clamped] for k in range(len(masses))],
            },
        )
    if output:
        make_folder(output)
        shown = {title: values for title, values in families.items() if values.shape[1]}
        plot_modes(np.asarray(masses), shown).savefig(output / "modes.png", dpi=130)
        console.print(f"wrote {output / 'modes.png'}")


def _controlled(arm: Arm, pose: jnp.ndarray) -> Table:
    """Frequency and damping of the arm as a textbook PD controls it."""
    linear = linearise(arm, pose, textbook_pd(arm, pose), ())
    found = closed_loop_modes(linear)
    table = Table(
        "as driven by the textbook PD, nominal payload", ["mode", "frequency [Hz]", "damping ratio"]
    )
    for i, (f, z) in enumerate(zip(found.frequency.tolist(), found.damping_ratio.tolist(), strict=True), 1):
        table.rows.append([str(i), number(f, 4), number(z, 3)])
    return table
