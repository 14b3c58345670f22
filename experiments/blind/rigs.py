"""The rigs: what the arm file says, what is true, how they are driven and what is logged."""

import zlib
from dataclasses import dataclass, field

import numpy as np

from .simulator import CHANNELS, COUNT, FAULTS, FORCES, SAMPLE

SAMPLES = 5000
RUNS = 2
UNITS = {"angle": "rad", "current": "A", "tip_deflection": "m", "rate": "rad/s", "strain": "1"}
NOISE = {"angle": COUNT / 12**0.5, "current": 0.01, "tip_deflection": 2e-5, "rate": 0.02, "strain": 1e-6}
UNCERTAINTY = {"default": 0.03, "damping_ratio": 0.2, "viscous_friction": 0.2}
ERROR = {"default": 0.02, "damping_ratio": 0.15, "viscous_friction": 0.15}
RIGID = dict(
    foreshortening=0.0,
    base_inertia=0.0, base_compliance=0.0, joint_compliance=0.0, root_compliance=0.0,
    backlash=0.0, extra_damping=0.0, rise=0.0,
)  # fmt: skip


@dataclass(frozen=True)
class Nominal:
    """A rig as its arm file has it: SI parameters, and the gains of the controller [V/rad], [V s/rad]."""

    name: str
    body: dict[str, float]
    stiffness: float
    damping: float
    channels: tuple[str, ...]

    @property
    def uncertainty(self) -> dict[str, float]:
        """Relative standard deviation of every parameter, as the arm file states it."""
        known = {k: v for k, v in self.body.items() if v > 0}
        return {k: UNCERTAINTY.get(k, UNCERTAINTY["default"]) for k in known}

    def toml(self) -> str:
        """The arm file."""
        b = self.body
        lines = [f'name = "{self.name}"', "gravity = 0.0"]
        if b["length"] > 0:
            lines += ["", "[[link]]"]
            section = ("length", "width", "thickness", "youngs_modulus", "density", "damping_ratio")
            lines += [f"{k} = {b[k]!r}" for k in section] + ["modes = 2"]
        lines += ["", "[[joint]]", *(f"{k} = {b[k]!r}" for k in ("hub_inertia", "viscous_friction"))]
        motor = ("resistance", "inductance", "torque_constant", "back_emf_constant")
        lines += ["", "[joint.motor]", *(f"{k} = {b[k]!r}" for k in motor)]
        if b["length"] > 0:
            lines += ["", "[payload]", f"mass = {b['payload_mass']!r}", f"inertia = {b['payload_inertia']!r}"]
        lines += ["", "[uncertainty]", *(f"{k} = {v!r}" for k, v in UNCERTAINTY.items())]
        return "\n".join(lines) + "\n"


MOTOR = dict(resistance=1.2, inductance=1.5e-3, torque_constant=0.062, back_emf_constant=0.062)
SINGLE_LINK = Nominal(
    "single-link rig",
    dict(
        length=0.395, width=0.0395, thickness=0.0014, youngs_modulus=78.2e9, density=2700.0,
        damping_ratio=0.006, hub_inertia=1.1e-4, viscous_friction=2e-4, **MOTOR,
        payload_mass=0.02, payload_inertia=2e-6,
    ),
    stiffness=4.0, damping=0.06, channels=("angle", "current", "tip_deflection"),
)  # fmt: skip
AXIS = Nominal(
    "bare motor axis",
    dict(
        length=0.0, width=0.0, thickness=0.0, youngs_modulus=0.0, density=0.0, damping_ratio=0.0,
        hub_inertia=2e-3, viscous_friction=1e-3, **MOTOR, payload_mass=0.0, payload_inertia=0.0,
    ),
    stiffness=4.0, damping=0.1, channels=("angle", "current"),
)  # fmt: skip
NOMINAL = {"single_link": SINGLE_LINK, "axis": AXIS}


@dataclass
class Rig:
    """One true plant with its two runs.

    `body`: parameters of `structure`; `forces`, `faults`: those of the simulator; `reference`
    [rad] and `disturbance` [N m], [samples, runs]; `clock`: s lost per s, one a channel;
    `peak`: largest voltage [V] and angle [rad] of the runs with nothing hidden.
    """

    nominal: Nominal
    body: dict[str, float]
    forces: dict[str, float]
    reference: np.ndarray
    disturbance: np.ndarray
    faults: dict[str, np.ndarray] = field(
        default_factory=lambda: {k: np.full(len(CHANNELS), v) for k, v in FAULTS.items()}
    )
    clock: np.ndarray = field(default_factory=lambda: np.zeros(len(CHANNELS)))
    peak: dict[str, float] = field(default_factory=dict)


def generator(*key: object) -> np.random.Generator:
    """Random numbers that depend on the key alone."""
    return np.random.default_rng(zlib.crc32(repr(key).encode()))


def true_rig(plant: str, key: object) -> Rig:
    """A rig of `plant` with nothing hidden: nominal parameters off by ERROR, its own references."""
    nominal, draw = NOMINAL[plant], generator(plant, key)
    body = {
        k: v * np.exp(ERROR.get(k, ERROR["default"]) * draw.standard_normal())
        for k, v in nominal.body.items()
    }
    forces = FORCES | dict(
        stiffness=nominal.stiffness * draw.uniform(0.7, 1.3), damping=nominal.damping * draw.uniform(0.5, 1.5)
    )
    reference = np.stack([moves(draw), sweep(draw)], axis=1)
    return Rig(nominal, body | RIGID, forces, reference, np.zeros((SAMPLES, RUNS)))


def moves(draw: np.random.Generator) -> np.ndarray:
    """Smooth moves between random angles [rad], with rests."""
    times = np.arange(SAMPLES) * SAMPLE
    out, at, time = np.zeros(SAMPLES), 0.0, 0.2
    while time < times[-1]:
        to, lasting = draw.uniform(-0.9, 0.9), draw.uniform(0.3, 0.9)
        s = np.clip((times - time) / lasting, 0, 1)
        out += (to - at) * s**3 * (10 - 15 * s + 6 * s * s)
        at, time = to, time + lasting + draw.uniform(0.1, 1.2)
    return out


def sweep(draw: np.random.Generator) -> np.ndarray:
    """Six sines [rad] of 0.15 to 4 Hz, faded in."""
    times = np.arange(SAMPLES) * SAMPLE
    hertz = np.geomspace(0.15, 4.0, 6) * draw.uniform(0.8, 1.25, 6)
    size = 0.35 * draw.uniform(0.4, 1.0, 6) / np.sqrt(1 + (hertz / 0.8) ** 2)
    phase = draw.uniform(0, 2 * np.pi, 6)
    waves = size * np.sin(2 * np.pi * hertz * times[:, None] + phase)
    return waves.sum(axis=1) * np.minimum(times / 0.5, 1.0) ** 2
