"""The picture of the catalogue's page: torques at a joint, over what tells them."""

import io
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure
from mkdocs.structure.files import File, Files

from jaxflex import EFFECTS


def on_files(files: Files, config) -> Files:
    """Add the picture."""
    files.append(File.generated(config, "effects/torques.png", content=torques()))
    return files


def torques() -> bytes:
    """What the effects at a joint look like against the quantity that tells them."""
    against = {
        "rate": ("joint rate [rad/s]", np.linspace(-2, 2, 401), lambda e, x: e(zero, x, zero)),
        "angle": ("joint angle [rad]", np.linspace(-2, 2, 401), lambda e, x: e(x, zero, zero)),
        "time": ("time [s]", np.linspace(0, 4, 401), lambda e, x: e(zero, zero, x)),
    }
    zero = jnp.zeros(())
    shown = {
        "coulomb_friction": ("rate", {}),
        "stribeck_friction": ("rate", {"level": 0.5, "stribeck_rate": 0.3}),
        "asymmetric_friction": ("rate", {}),
        "quadratic_drag": ("rate", {}),
        "cable_stiffness": ("angle", {}),
        "cogging_torque": ("angle", {}),
        "load_torque_bias": ("angle", {}),
        "periodic_disturbance": ("time", {}),
    }
    figure = Figure(figsize=(10, 4.4), layout="constrained")
    for axis, (name, (way, options)) in zip(figure.subplots(2, 4).flat, shown.items(), strict=True):
        label, x, torque = against[way]
        values = jax.vmap(partial(torque, EFFECTS[name](1.0, **options)))(jnp.asarray(x))
        axis.plot(x, values / jnp.abs(values).max())
        axis.set_ylim(-1.2, 1.2)
        axis.axhline(0, color="0.5", linewidth=0.5)
        axis.set_title(name, fontsize=10, family="monospace")
        axis.set_xlabel(label, fontsize=9)
        axis.set_yticks([0])
    figure.supylabel("torque that the model lacks, scaled [1]", fontsize=9)
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=110)
    return stream.getvalue()
