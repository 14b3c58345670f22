"""Effects that no catalogue names: an honest diagnosis calls them unexplained."""

import numpy as np

from .effects import EFFECTS, LINKED, effect, sensor
from .rigs import NOISE, RUNS, SAMPLES
from .simulator import CHANNELS, SAMPLE


@effect("outside:cubic_link_stiffness", 2e4, 1e8, LINKED)
def cubic_link_stiffness(rig, size, j, draw):
    rig.laws["hardening"][j] = size
    return f"link_{j + 1}", {"stiffness": size}


@effect("outside:friction_patch", 0.01, 0.5)
def friction_patch(rig, size, j, draw):
    """Dry friction over a short range of angles only."""
    place, width = draw.uniform(-0.2, 0.3), draw.uniform(0.05, 0.12)
    rig.set(j, patch=size, patch_angle=place, patch_width=width)
    return f"joint_{j + 1}", {"torque": size, "angle": place, "width": width}


@effect("outside:growing_friction", 0.001, 0.05)
def growing_friction(rig, size, j, draw):
    """Dry friction that grows from nothing, in N m a second."""
    rig.laws["growth"][j] = size
    return f"joint_{j + 1}", {"torque_rate": size}


@effect("outside:load_dependent_friction", 0.05, 0.95)
def load_dependent_friction(rig, size, j, draw):
    """Dry friction in proportion to the motor's torque, as in a gear."""
    rig.laws["load_friction"][j] = size
    return f"joint_{j + 1}", {"share": size}


@effect("outside:magnetic_saturation", 0.01, 3.0)
def magnetic_saturation(rig, size, j, draw):
    """Both motor constants fall with the current: K / (1 + a i^2)."""
    rig.laws["magnetic"][j] = size
    return f"joint_{j + 1}", {"per_square_ampere": size}


@effect("outside:base_resonance", 0.003, 0.5, ("single_link", "axis"))
def base_resonance(rig, size, j, draw):
    """The motor's stator on a spring, with an inertia of its own."""
    frequency = draw.uniform(6.0, 18.0)
    inertia = 1 / (size * (2 * np.pi * frequency) ** 2) if size else 0.0
    rig.body["base_compliance"][j], rig.body["base_inertia"][j] = size, inertia
    return "base", {"compliance": size, "frequency": frequency}


@effect("outside:soft_stop", 5.0, 2e3, ("single_link",))
def soft_stop(rig, size, j, draw):
    """The tip meets a soft wall on one side of its range."""
    place = draw.uniform(0.5, 0.7) * rig.peak["angle"] * rig.body["length"][j]
    rig.arm |= {"stop": size, "stop_place": place}
    return "tip", {"stiffness": size, "place": place}


@effect("outside:random_torque", 0.004, 0.5)
def random_torque(rig, size, j, draw):
    """A random torque of `size` rms at the hub, white below a few Hz."""
    corner = draw.uniform(2.0, 6.0)
    keep = np.exp(-2 * np.pi * corner * SAMPLE)
    out = np.zeros((SAMPLES, RUNS))
    white = draw.standard_normal((SAMPLES, RUNS)) * np.sqrt(1 - keep**2)
    for k in range(1, SAMPLES):
        out[k] = keep * out[k - 1] + white[k]
    rig.disturbance[..., j] += size * out
    return f"joint_{j + 1}", {"rms": size, "corner": corner}


@effect("outside:current_crosstalk", 3.0, 1e4, LINKED)
def current_crosstalk(rig, size, j, draw):
    """The motor's current leaks into the strain or deflection reading."""
    c, name = sensor(rig, j, draw, ("strain",) if "strain" in rig.nominal.channels else ("tip_deflection",))
    rig.faults["crosstalk"][c, j] = size * NOISE[CHANNELS[c]]
    return name, {"per_ampere": size * NOISE[CHANNELS[c]]}


@effect("outside:sensor_nonlinearity", 0.02, 1.0)
def sensor_nonlinearity(rig, size, j, draw):
    """A reading with a square in it: y + a y^2."""
    c, name = sensor(rig, j, draw, ("current", "tip_deflection"))
    span = {"current": 2.0, "tip_deflection": 0.01}[CHANNELS[c]]
    rig.faults["quadratic"][c, j] = size / span
    return name, {"per_unit": size / span}


@effect("outside:clock_drift", 5e-4, 0.02)
def clock_drift(rig, size, j, draw):
    """One channel's clock runs slow: its samples are ever older than their time."""
    c, name = sensor(rig, j, draw, ("current", "tip_deflection"))
    rig.clock[c, j] = size
    return name, {"seconds_per_second": size}


@effect("outside:gust", 0.03, 5.0)
def gust(rig, size, j, draw):
    """One push a run, at a random time."""
    times = np.arange(SAMPLES)[:, None] * SAMPLE
    begin, lasting = draw.uniform(1.5, 8.5, RUNS), draw.uniform(0.1, 0.3)
    inside = (times > begin) & (times < begin + lasting)
    push = size * np.sin(np.pi * (times - begin) / lasting) ** 2 * draw.choice([-1, 1])
    rig.disturbance[..., j] += np.where(inside, push, 0.0)
    return f"joint_{j + 1}", {"torque": size, "lasting": lasting}


OUTSIDE = tuple(name for name in EFFECTS if name.startswith("outside:"))
CATALOGUE = tuple(name for name in EFFECTS if name not in OUTSIDE)
