"""Every effect that an arm could be missing, each absent, and how a small one would show.

An effect enters the screening as columns: slopes of all readings by its amplitudes. A
torque, or a voltage, that depends on the motion is a column of forces along the motion
that the model predicts; all others are slopes by a parameter of the arm.
"""

# arrays of numpy go to JAX and come back, which its annotations do not foresee
# pyright: reportArgumentType=false, reportOptionalMemberAccess=false, reportAttributeAccessIssue=false

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from ..arm.arm import Arm
from ..drive import has_current_state
from ..effects import EFFECTS, AbstractDryFriction, AbstractEffect, AbstractJointEffect
from ..files.arm_file import places
from .parameters import Parameters
from .plant import bristles
from .runs import Run
from .shooting import Problem

ORDERS = (3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 14, 16, 18, 20, 24, 28, 32, 36)  # of cogging, periods a turn
WAVES = 1.0  # of a ripple that the motion must span
STRIBECK = (0.03, 0.1, 0.3)  # of the rms speed
BENDING_TIME = 4e-4  # s at a joint's typical rate: how far dry friction bends, at a first guess
BRISTLE_DAMPING = 1e-4  # s, at a first guess
TAIL = 0.5  # of Stribeck's friction, between the two forms in use, at a first guess
FORM = ("presliding", "bristle_damping", "tail")  # of dry friction: how, not how much
SIGN = 2e-6  # of a joint's typical rate: where the sign of friction changes, the bristle aside; it never rests there
RIGID_SIGN = 2e-3  # the same of a law without a bristle, narrow enough to integrate
LEAST_RISE = 0.05  # of friction towards rest, of its level: below it there is none
MOST_RISE = 3.0  # the same: nothing sticks harder
SATURATION = (0.4, 0.55, 0.7, 0.8, 0.88, 0.95, 0.98)  # of the largest command
COOLING = (0.0, 10.0)  # s


@dataclass(frozen=True)
class Candidate:
    """An effect that may be missing, in one of the shapes that are tried.

    `amplitudes`: its parameters that enter linearly, none where a size in `shape` is tried
    as it is; `shape`: values of the others; `free`: those that a full fit may move.
    """

    effect: str
    location: str
    amplitudes: tuple[str, ...]
    shape: tuple[tuple[str, float], ...] = ()
    free: tuple[str, ...] = ()

    @property
    def count(self) -> int:
        """Number of parameters that a fit may choose, the form of friction left aside."""
        return len(self.amplitudes) + sum(name not in FORM for name in self.free)

    @property
    def index(self) -> int:
        """Index of its joint or link, counted from zero."""
        return index(self.location)

    @property
    def key(self) -> tuple[str, str]:
        """Effect and location: what a report names."""
        return self.effect, self.location


def index(location: str) -> int:
    """Index of `joint_1`, `link_2` or the like, counted from zero."""
    return int(location.rpartition("_")[2]) - 1


# amplitudes that may have either sign; all others would be unphysical below zero
EITHER_SIGN = {
    "asymmetric_friction", "cogging_torque", "load_torque_bias", "periodic_disturbance", "torque_constant",
    "payload_mass", "hub_inertia", "gravity", "structural_damping", "viscous_friction",
    "sensor_bias", "sensor_gain", "sensor_drift",
}  # fmt: skip
# and where they make sense only within bounds
BOUNDS = {"centrifugal_stiffening": (0.3, 30.0), "sensor_gain": (-0.75, 2.0)}


def plausible(candidate: Candidate, step: tuple[float, ...]) -> bool:
    """False for a friction that pushes, a spring that drives away, a lag into the future."""
    if not candidate.amplitudes:
        return bool(0.3 < step[0] < 3.0)
    if candidate.effect == "stribeck_friction" and not LEAST_RISE * step[1] <= step[0] <= MOST_RISE * step[1]:
        return False  # which is Coulomb's, or no friction at all where it matters
    anything = (-np.inf, np.inf) if candidate.effect in EITHER_SIGN else (0.0, np.inf)
    low, high = BOUNDS.get(candidate.effect, anything)
    return all(low <= value <= high for value in step[: len(candidate.amplitudes)])


def template(arm: Arm, channels: tuple[str, ...], rates: list[float]) -> list[AbstractEffect]:
    """One absent effect of every kind at every place that this arm has; `rates` [rad/s] typical of its joints."""
    found = []
    for kind in EFFECTS.values():
        for location in places(kind, arm.links, arm.joints):
            if not _possible(kind.name, location, arm, channels):
                continue
            options = {}
            if issubclass(kind, AbstractDryFriction):
                rate = rates[index(location)]
                options |= {"transition_rate": SIGN * rate, "presliding": BENDING_TIME * rate}
            found.append(kind(0.0, location=location, **options))
    return found


def _possible(name: str, location: str, arm: Arm, channels: tuple[str, ...]) -> bool:
    if name == "backlash":
        # a joint that may come apart has a coordinate more; see `loose_joint`
        return arm.joints[index(location)].play is not None
    if name in ("voltage_saturation", "voltage_dead_zone", "winding_heating"):
        return arm.drive == "voltage"
    if name == "torque_constant":
        return arm.drive != "torque"
    if name in ("payload_mass", "gravity"):
        return bool(arm.links)
    if name in ("root_compliance", "structural_damping", "centrifugal_stiffening"):
        return arm.links[index(location)].modes > 0
    if name == "joint_flexibility":
        joint = index(location)
        bends = joint < len(arm.links) and arm.links[joint].modes > 0
        return bends or arm.joints[joint].play is not None
    if name.startswith("sensor_"):
        return location in channels
    return True


def candidates(
    parameters: Parameters, motions: "Sequence[Motion]", frequencies: list[float]
) -> Iterator[Candidate]:
    """Every candidate for these motions; `frequencies` [Hz] are those worth trying for a disturbance."""
    for effect in parameters.effects:
        name, location = effect.name, effect.location
        if name == "stribeck_friction":
            for share in STRIBECK:
                rate = share * max(motion.rms_rate(effect.index) for motion in motions)
                shape = (("stribeck_rate", rate), ("tail", TAIL), *_bristle(effect))
                yield Candidate(name, location, ("torque", "level"), shape, tuple(dict(shape)))
        elif name == "cogging_torque":
            for order in ORDERS:
                if order * max(motion.range(effect.index) for motion in motions) < WAVES * 2 * np.pi:
                    continue  # too little of a wave to tell it from any other curve
                yield Candidate(name, location, ("sine", "cosine"), (("order", float(order)),))
        elif name == "periodic_disturbance":
            for f in frequencies:
                yield Candidate(name, location, ("sine", "cosine"), (("frequency", f),), ("frequency",))
        elif name == "voltage_saturation":
            largest = max(motion.largest_command(effect.index) for motion in motions)
            for share in SATURATION:
                yield Candidate(name, location, (), (("limit", share * largest),), ("limit",))
        elif name == "torque_constant":
            for share in (0.0, 1.0):
                yield Candidate(name, location, ("change",), (("back_emf_share", share),))
        elif name == "winding_heating":
            for time in COOLING:
                free = ("cooling_time",) if time else ()
                yield Candidate(name, location, ("coefficient",), (("cooling_time", time),), free)
        elif name == "gravity":
            yield Candidate(name, location, ("along_y", "along_x"))
        elif name == "cable_stiffness":
            yield Candidate(name, location, ("stiffness",), (("rest_angle", 0.0),), ("rest_angle",))
        elif name in ("coulomb_friction", "asymmetric_friction"):
            shape = _bristle(effect)
            yield Candidate(name, location, ("torque",), shape, tuple(dict(shape)))
        else:
            yield Candidate(name, location, (next(iter(effect.units)),))


def _bristle(effect: AbstractEffect) -> tuple[tuple[str, float], ...]:
    return ("presliding", float(effect.presliding)), ("bristle_damping", BRISTLE_DAMPING)


class Motion:
    """The motion that a model predicts for a run, sample by sample and in between."""

    def __init__(self, problem: Problem, run: Run, vector: np.ndarray):
        parameters = problem.setting.parameters
        response = problem.predict(run, vector)
        pieces, _ = problem.pieces(run, vector)
        states, ends = np.asarray(response.states), np.asarray(response.end)
        self.parameters = parameters
        self.arm = parameters.build(jnp.asarray(vector))
        self.model = self.arm.assemble()
        self.command = np.asarray(pieces.command)
        self.time = np.asarray(pieces.time)
        self.dt = problem.setting.sample_time
        following = np.concatenate([states[:, 1:], ends[:, None]], 1)
        weights = np.array([0.125, 0.375, 0.625, 0.875])
        # (points, pieces, samples, states): within each interval, along a straight line
        self.between = states + weights[:, None, None, None] * (following - states)

    def angle(self, joint: int) -> np.ndarray:
        """Angle [rad] within each interval."""
        return self.between[..., joint]

    def rate(self, joint: int) -> np.ndarray:
        """Rate [rad/s] within each interval."""
        return self.between[..., self.model.size + joint]

    def bend(self, joint: int) -> np.ndarray:
        """How the bristle of dry friction is bent within each interval."""
        return self.between[..., bristles(self.model).start + joint]

    def current(self, joint: int) -> np.ndarray:
        """Current [A] within each interval."""
        arm, n = self.arm, self.model.size
        before = sum(has_current_state(self.model, i) for i in range(joint))
        if has_current_state(self.model, joint):
            return self.between[..., 2 * n + before]
        if arm.drive == "current":
            return np.broadcast_to(self.command[..., joint], self.rate(joint).shape)
        motor = arm.joints[joint].motor
        emf = float(motor.back_emf_constant * motor.gear_ratio) * self.rate(joint)
        return (self.command[..., joint] - emf) / float(motor.resistance)

    def range(self, joint: int) -> float:
        """Range of the joint's angle [rad]."""
        return float(np.ptp(self.angle(joint)))

    def rms_rate(self, joint: int) -> float:
        """Root mean square of the joint's rate [rad/s]."""
        return float(np.sqrt(np.mean(self.rate(joint) ** 2)))

    def largest_command(self, joint: int) -> float:
        """Largest command of the joint."""
        return float(np.abs(self.command[..., joint]).max())

    def heat(self, joint: int, cooling: float) -> np.ndarray:
        """Heat [J] in the winding since the start of the run."""
        motor = self.arm.joints[joint].motor
        power = float(motor.resistance) * (self.current(joint) ** 2).mean(0).ravel()
        keep = np.exp(-self.dt / cooling) if cooling > 0 else 1.0
        found = np.zeros_like(power)
        for k in range(1, len(power)):
            found[k] = keep * found[k - 1] + power[k - 1] * self.dt
        return found.reshape(self.command.shape[:2])

    def forcing(self, candidate: Candidate) -> np.ndarray | None:
        """Columns of commands and forces, one an amplitude, or None for slopes by a parameter."""
        kind = EFFECTS[candidate.effect]
        if candidate.location.rpartition("_")[0] != "joint":
            return None
        joint = candidate.index
        joints = self.command.shape[2]
        blank = np.zeros((*self.command.shape[:2], joints + self.model.size))
        shape = dict(candidate.shape)
        if issubclass(kind, AbstractJointEffect):
            base = next(e for e in self.parameters.effects if (e.name, e.location) == candidate.key)
            columns, rest = [], []
            if candidate.effect == "cable_stiffness":
                # its rest angle enters as a constant torque
                column = blank.copy()
                column[..., joints + joint] = 1.0
                rest = [column]
            for amplitude in candidate.amplitudes:
                options = {f: getattr(base, f) for f in kind.units} | shape
                options |= dict.fromkeys(candidate.amplitudes, 0.0) | {amplitude: 1.0}
                effect = kind(location=candidate.location, **options)
                angle, rate = self.angle(joint), self.rate(joint)
                given = [angle, rate, np.broadcast_to(self.time + self.dt / 2, angle.shape)]
                if effect.initial() is not None:
                    given.append(self.bend(joint))
                flat = jax.vmap(effect)(*(jnp.asarray(v.ravel()) for v in given))
                torque = np.asarray(flat).reshape(angle.shape)
                column = blank.copy()
                column[..., joints + joint] = torque.mean(0)
                columns.append(column)
            return np.stack(columns + rest)
        command = self.command[..., joint]
        column = blank.copy()
        if candidate.effect == "voltage_dead_zone":
            column[..., joint] = -np.sign(command)
        elif candidate.effect == "voltage_saturation":
            column[..., joint] = np.clip(command, -shape["limit"], shape["limit"]) - command
        elif candidate.effect == "winding_heating":
            motor = self.arm.joints[joint].motor
            drop = float(motor.resistance) * self.current(joint).mean(0)
            column[..., joint] = -drop * self.heat(joint, shape["cooling_time"])
        elif candidate.effect == "torque_constant":
            motor = self.arm.joints[joint].motor
            per = float(motor.gear_ratio)
            column[..., joints + joint] = float(motor.efficiency) * per * self.current(joint).mean(0)
            column[..., joint] = -shape["back_emf_share"] * per * self.rate(joint).mean(0)
        else:
            return None
        return column[None]
