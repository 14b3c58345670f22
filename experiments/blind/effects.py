"""What can be hidden: each effect in its own physical form, written into a rig at a given size.

An effect is a function of the rig, the size, the joint (or its link), and random numbers for its
secondary choices. It
changes the rig and returns where it acts and the values that define it, by the names that the
library's own effects use. Size zero is absence.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .rigs import NOISE, RUNS, SAMPLES, Rig
from .simulator import CHANNELS, SAMPLE

Hidden = tuple[str, dict[str, float]]


@dataclass(frozen=True)
class Effect:
    """`hide(rig, size, joint, draw)`; `guess` a size that shows, `most` the largest that is believable.

    `plants` that can have it.
    """

    name: str
    hide: Callable[[Rig, float, int, np.random.Generator], Hidden]
    guess: float
    most: float
    plants: tuple[str, ...]


EFFECTS: dict[str, Effect] = {}
LINKED = ("single_link", "two_link")


def effect(
    name: str, guess: float, most: float, plants: tuple[str, ...] = ("single_link", "two_link", "axis")
):
    """Register a function under the name of its effect."""

    def keep(hide):
        EFFECTS[name] = Effect(name, hide, guess, most, plants)
        return hide

    return keep


def available(plant: str) -> dict[str, Effect]:
    """The effects that `plant` can have."""
    return {k: e for k, e in EFFECTS.items() if plant in e.plants}


# ---- joint


@effect("coulomb_friction", 0.005, 0.2)
def coulomb_friction(rig, size, j, draw):
    rig.set(j, dry=rig.laws["dry"][j] + size, presliding=draw.uniform(2e-4, 8e-4))
    return f"joint_{j + 1}", {"torque": size}


@effect("stribeck_friction", 0.005, 0.2)
def stribeck_friction(rig, size, j, draw):
    """A Coulomb level with more near rest: `torque` is the excess."""
    excess, rate = size * draw.uniform(0.6, 1.2), draw.uniform(0.1, 0.4)
    rig.set(j, dry=rig.laws["dry"][j] + size, stribeck=excess, stribeck_rate=rate)
    return f"joint_{j + 1}", {"torque": excess, "level": size, "stribeck_rate": rate}


@effect("asymmetric_friction", 0.005, 0.2)
def asymmetric_friction(rig, size, j, draw):
    """Dry friction that differs with direction: `torque` is half the difference."""
    share = draw.uniform(0.4, 0.8) * draw.choice([-1, 1])
    rig.set(j, dry=rig.laws["dry"][j] + size, asymmetry=share)
    return f"joint_{j + 1}", {"torque": size * share, "level": size}


@effect("quadratic_drag", 5e-4, 0.05)
def quadratic_drag(rig, size, j, draw):
    rig.laws["drag"][j] = size
    return f"joint_{j + 1}", {"coefficient": size}


@effect("cable_stiffness", 0.02, 3.0)
def cable_stiffness(rig, size, j, draw):
    rest = draw.uniform(-0.2, 0.2)
    rig.set(j, cable=size, cable_rest=rest)
    return f"joint_{j + 1}", {"stiffness": size, "rest_angle": rest}


@effect("cogging_torque", 0.004, 0.2)
def cogging_torque(rig, size, j, draw):
    order, phase = float(draw.choice([6, 8, 12])), draw.uniform(0, 2 * np.pi)
    rig.set(j, ripple=size, ripple_order=order, ripple_phase=phase)
    return f"joint_{j + 1}", {"sine": size * np.cos(phase), "cosine": size * np.sin(phase), "order": order}


@effect("load_torque_bias", 0.004, 0.2)
def load_torque_bias(rig, size, j, draw):
    torque = size * draw.choice([-1, 1])
    rig.laws["load"][j] = torque
    return f"joint_{j + 1}", {"torque": torque}


@effect("joint_flexibility", 0.01, 2.0)
def joint_flexibility(rig, size, j, draw):
    """A spring between rotor and hub; the encoder sits on the rotor."""
    rig.body["joint_compliance"][j] = size
    return f"joint_{j + 1}", {"compliance": size}


@effect("backlash", 1e-3, 0.1)
def backlash(rig, size, j, draw):
    """Rotor and hub apart, touching on either side of a gap; the encoder sits on the rotor."""
    rig.body["backlash"][j] = rig.laws["backlash"][j] = size / 2
    rig.set(j, contact=500.0 if size else 0.0, contact_damping=0.1 if size else 0.0)
    return f"joint_{j + 1}", {"gap": size}


# ---- drive


@effect("voltage_saturation", 0.3, 0.95)
def voltage_saturation(rig, size, j, draw):
    """`size`: the share cut off the largest voltage that the run would ask for."""
    rig.laws["limit"][j] = rig.peak["voltage"][j] * (1 - size)
    return f"joint_{j + 1}", {"limit": rig.laws["limit"][j]}


@effect("voltage_dead_zone", 0.05, 2.0)
def voltage_dead_zone(rig, size, j, draw):
    rig.laws["dead_zone"][j] = size
    return f"joint_{j + 1}", {"width": size}


@effect("input_delay", 0.002, 0.04)
def input_delay(rig, size, j, draw):
    rig.laws["delay"][j] = size
    return f"joint_{j + 1}", {"delay": size}


@effect("torque_constant", 0.1, 2.0)
def torque_constant(rig, size, j, draw):
    """Wrong by the factor 1 + size or its inverse; half the time the back-EMF constant goes with it."""
    share = float(draw.integers(2))
    change = rig.body["torque_constant"][j] * ((1 + size) ** draw.choice([-1.0, 1.0]) - 1)
    rig.body["torque_constant"][j] += change
    rig.body["back_emf_constant"][j] += share * change
    return f"joint_{j + 1}", {"change": change, "back_emf_share": share}


@effect("winding_heating", 0.02, 2.0)
def winding_heating(rig, size, j, draw):
    """Resistance grows by `size` of itself a second at one ampere, and falls back slowly."""
    time = draw.uniform(6, 20)
    rig.set(j, warming=size, cooling=1 / time)
    return f"joint_{j + 1}", {"coefficient": size / rig.body["resistance"][j], "cooling_time": time}


# ---- body


@effect("payload_mass", 0.01, 0.3, LINKED)
def payload_mass(rig, size, j, draw):
    rig.body["payload_mass"][0] += size
    return "tip", {"mass": size}


@effect("hub_inertia", 2e-4, 0.05)
def hub_inertia(rig, size, j, draw):
    rig.body["hub_inertia"][j] += size
    return f"joint_{j + 1}", {"inertia": size}


@effect("root_compliance", 0.01, 2.0, LINKED)
def root_compliance(rig, size, j, draw):
    """A spring between hub and link; the tip is seen from the hub."""
    rig.body["root_compliance"][j] = size
    return f"link_{j + 1}", {"compliance": size}


@effect("gravity", 0.2, 9.81, LINKED)
def gravity(rig, size, j, draw):
    """A tilted base: the part of gravity in the plane, along -y or up to half a radian from it."""
    direction = draw.choice([0.0, draw.uniform(-0.5, 0.5)])
    rig.arm |= {"gravity_field": size, "gravity_direction": direction}
    return "base", {"along_y": size * np.cos(direction), "along_x": size * np.sin(direction)}


@effect("structural_damping", 0.01, 0.5, LINKED)
def structural_damping(rig, size, j, draw):
    """More damping in the link: the same ratio in every mode, or rising with frequency (Kelvin-Voigt)."""
    rise = float(draw.integers(2))
    rig.body["extra_damping"][j], rig.body["rise"][j] = size, rise
    return f"link_{j + 1}", {"ratio": size, "rise": rise}


@effect("centrifugal_stiffening", 1.0, 20.0, LINKED)
def centrifugal_stiffening(rig, size, j, draw):
    """Foreshortening; 1 is what the link itself has, more stands for an axial load that turns with it."""
    rig.body["foreshortening"][j] = size
    return f"link_{j + 1}", {"share": size}


@effect("viscous_friction", 5e-4, 0.2)
def viscous_friction(rig, size, j, draw):
    rig.body["viscous_friction"][j] += size
    return f"joint_{j + 1}", {"coefficient": size}


# ---- sensors


def sensor(rig: Rig, j: int, draw, candidates: tuple[str, ...]) -> tuple[int, str]:
    """One of the logged channels among the candidates: its index and its name in the recording."""
    name = str(draw.choice([c for c in candidates if c in rig.nominal.channels]))
    return CHANNELS.index(name), f"{name}_{j + 1}"


@effect("sensor_bias", 4.0, 1e4)
def sensor_bias(rig, size, j, draw):
    c, name = sensor(rig, j, draw, ("current", "tip_deflection", "strain"))
    value = size * NOISE[CHANNELS[c]] * draw.choice([-1, 1])
    rig.faults["bias"][c, j] += value
    return name, {"bias": value}


@effect("sensor_gain", 0.05, 2.0)
def sensor_gain(rig, size, j, draw):
    c, name = sensor(rig, j, draw, ("angle", "current", "tip_deflection", "strain"))
    factor = (1 + size) ** draw.choice([-1, 1])
    rig.faults["gain"][c, j] *= factor
    return name, {"error": factor - 1}


@effect("sensor_lag", 0.004, 0.3)
def sensor_lag(rig, size, j, draw):
    c, name = sensor(rig, j, draw, ("angle", "current", "tip_deflection", "strain"))
    rig.faults["lag"][c, j] = size
    return name, {"lag": size}


@effect("sensor_drift", 1.0, 3e3)
def sensor_drift(rig, size, j, draw):
    c, name = sensor(rig, j, draw, ("current", "tip_deflection", "strain"))
    value = size * NOISE[CHANNELS[c]] * draw.choice([-1, 1])
    rig.faults["drift"][c, j] = value
    return name, {"rate": value}


# ---- from outside


@effect("periodic_disturbance", 0.003, 0.3)
def periodic_disturbance(rig, size, j, draw):
    """A sine of torque on the hub, in the two runs with the same phase or with one of its own."""
    frequency, phase = draw.uniform(1.5, 12.0), draw.uniform(0, 2 * np.pi, RUNS)
    phase = draw.choice([phase, phase[[0, 0]]])
    times = np.arange(SAMPLES)[:, None] * SAMPLE
    rig.disturbance[..., j] += size * np.sin(2 * np.pi * frequency * times + phase)
    return f"joint_{j + 1}", {
        "torque": size,
        "frequency": frequency,
        "phase_1": phase[0],
        "phase_2": phase[1],
    }
