"""The rigs: what the arm file says, what is true, how they are driven and what is logged."""

import dataclasses
import zlib
from dataclasses import dataclass, field
from types import ModuleType

import numpy as np

from . import one_link, two_link
from .joint import LAWS
from .simulator import ARM, CHANNELS, COUNT, FAULTS, SAMPLE

SAMPLES = 5000
RUNS = 2
UNITS = {"angle": "rad", "current": "A", "tip_deflection": "m", "rate": "rad/s", "strain": "1"}
NOISE = {"angle": COUNT / 12**0.5, "current": 0.01, "tip_deflection": 2e-5, "rate": 0.02, "strain": 1e-6}
UNCERTAINTY = {"default": 0.03, "damping_ratio": 0.2, "viscous_friction": 0.2}
ERROR = {"default": 0.02, "damping_ratio": 0.15, "viscous_friction": 0.15}
LINK = ("length", "width", "thickness", "youngs_modulus", "density", "damping_ratio")
JOINT = ("hub_inertia", "viscous_friction")
MOTOR = ("resistance", "inductance", "torque_constant", "back_emf_constant")
RIGHT = dict(  # of every joint: what a body has only where it is hidden
    base_inertia=0.0, base_compliance=0.0, joint_compliance=0.0, root_compliance=0.0,
    backlash=0.0, extra_damping=0.0, rise=0.0, foreshortening=0.0,
)  # fmt: skip


@dataclass(frozen=True)
class Nominal:
    """A rig as its arm file has it.

    `body`: SI parameters, a tuple over joints (the payload's: one); `stiffness` [V/rad] and
    `damping` [V s/rad] of the controller; `reach`: scale of the references; `physics`: its mechanics.
    """

    name: str
    physics: ModuleType
    body: dict[str, tuple[float, ...]]
    stiffness: tuple[float, ...]
    damping: tuple[float, ...]
    channels: tuple[str, ...]
    reach: float = 1.0

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.stiffness)

    @property
    def uncertainty(self) -> dict[tuple[str, int], float]:
        """Relative standard deviation of every parameter (name, joint), as the arm file states it."""
        return {
            (name, j): UNCERTAINTY.get(name, UNCERTAINTY["default"])
            for name, values in self.body.items()
            for j, value in enumerate(values)
            if value > 0
        }

    def toml(self) -> str:
        """The arm file."""

        def pairs(names: tuple[str, ...], j: int) -> list[str]:
            return [f"{k} = {self.body[k][j]!r}" for k in names if k in self.body]

        lines = [f'name = "{self.name}"', "gravity = 0.0"]
        linked = self.body["length"][0] > 0
        for j in range(self.joints if linked else 0):
            lines += ["", "[[link]]", *pairs(LINK, j), "modes = 2"]
        for j in range(self.joints):
            lines += ["", "[[joint]]", *pairs((*JOINT, "hub_mass"), j), "", "[joint.motor]", *pairs(MOTOR, j)]
        if linked:
            lines += ["", "[payload]"] + [
                f"{k} = {self.body[f'payload_{k}'][0]!r}" for k in ("mass", "inertia")
            ]
        lines += ["", "[uncertainty]", *(f"{k} = {v!r}" for k, v in UNCERTAINTY.items())]
        return "\n".join(lines) + "\n"


SMALL_MOTOR = dict(
    resistance=(1.2,), inductance=(1.5e-3,), torque_constant=(0.062,), back_emf_constant=(0.062,)
)
NOMINAL = {
    "single_link": Nominal(
        "single-link rig",
        one_link,
        dict(
            length=(0.395,), width=(0.0395,), thickness=(0.0014,), youngs_modulus=(78.2e9,),
            density=(2700.0,), damping_ratio=(0.006,), hub_inertia=(1.1e-4,), viscous_friction=(2e-4,),
            **SMALL_MOTOR, payload_mass=(0.02,), payload_inertia=(2e-6,),
        ),
        stiffness=(4.0,), damping=(0.06,), channels=("angle", "current", "tip_deflection"),
    ),
    "axis": Nominal(
        "bare motor axis",
        one_link,
        dict(
            length=(0.0,), width=(0.0,), thickness=(0.0,), youngs_modulus=(0.0,), density=(0.0,),
            damping_ratio=(0.0,), hub_inertia=(2e-3,), viscous_friction=(1e-3,), **SMALL_MOTOR,
            payload_mass=(0.0,), payload_inertia=(0.0,),
        ),
        stiffness=(4.0,), damping=(0.1,), channels=("angle", "current"),
    ),
    "two_link": Nominal(
        "two-link rig",
        two_link,
        dict(
            length=(0.5, 0.4), width=(0.03, 0.025), thickness=(0.003, 0.0015), youngs_modulus=(70e9, 70e9),
            density=(2700.0, 2700.0), damping_ratio=(0.008, 0.008), hub_inertia=(5e-3, 1e-3),
            hub_mass=(0.0, 0.3), viscous_friction=(5e-3, 2e-3), resistance=(2.0, 2.0),
            inductance=(4e-3, 4e-3), torque_constant=(0.2, 0.2), back_emf_constant=(0.2, 0.2),
            payload_mass=(0.05,), payload_inertia=(1e-5,),
        ),
        stiffness=(15.0, 3.0), damping=(1.5, 0.2), channels=("angle", "current", "tip_deflection"), reach=0.55,
    ),
}  # fmt: skip


@dataclass
class Rig:
    """One true plant with its two runs.

    - `body` [joints]: parameters of the mechanics; `laws` [joints]: LAWS and the controller's gains;
      `arm`: ARM; `faults` [channels, joints]
    - `reference` [rad] and `disturbance` [N m], [samples, runs, joints]
    - `clock` [channels, joints]: s lost per s
    - `peak`: largest voltages [V], and the largest first angle [rad], of the runs with nothing hidden
    """

    nominal: Nominal
    body: dict[str, np.ndarray]
    laws: dict[str, np.ndarray]
    arm: dict[str, float]
    faults: dict[str, np.ndarray]
    clock: np.ndarray
    reference: np.ndarray
    disturbance: np.ndarray
    peak: dict[str, np.ndarray] = field(default_factory=dict)

    def copy(self) -> "Rig":
        """A rig to hide something in."""
        tables = {
            name: {k: v.copy() for k, v in getattr(self, name).items()} for name in ("body", "laws", "faults")
        }
        arrays = {name: getattr(self, name).copy() for name in ("clock", "disturbance")}
        return dataclasses.replace(self, arm=dict(self.arm), **tables, **arrays)

    def set(self, j: int, **laws: float) -> None:
        """Set laws of joint `j`."""
        for name, value in laws.items():
            self.laws[name][j] = value


def generator(*key: object) -> np.random.Generator:
    """Random numbers that depend on the key alone."""
    return np.random.default_rng(zlib.crc32(repr(key).encode()))


def true_rig(plant: str, key: object, also: tuple[str, ...] = ()) -> Rig:
    """A rig of `plant` with nothing hidden: nominal parameters off by ERROR, its own references."""
    nominal, draw = NOMINAL[plant], generator(plant, key)
    nominal = dataclasses.replace(nominal, channels=(*nominal.channels, *also))
    n = nominal.joints
    body = {
        k: np.array(v) * np.exp(ERROR.get(k, ERROR["default"]) * draw.standard_normal(len(v)))
        for k, v in nominal.body.items()
    }
    laws = {k: np.full(n, v) for k, v in LAWS.items()}
    laws["stiffness"] = np.array(nominal.stiffness) * draw.uniform(0.7, 1.3, n)
    laws["damping"] = np.array(nominal.damping) * draw.uniform(0.5, 1.5, n)
    reference = [np.stack([make(draw) for _ in range(n)], axis=-1) for make in (moves, sweep)]
    shape = (len(CHANNELS), n)
    return Rig(
        nominal,
        body | {k: np.full(n, v) for k, v in RIGHT.items()},
        laws,
        dict(ARM),
        {k: np.full(shape, v) for k, v in FAULTS.items()},
        np.zeros(shape),
        nominal.reach * np.stack(reference, axis=1),
        np.zeros((SAMPLES, RUNS, n)),
    )


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
