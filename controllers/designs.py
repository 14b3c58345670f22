"""Designs: a controller, a move and a shaper together, and the textbook ones to compare with."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from jaxflex import (
    AbstractController,
    Arm,
    AssembledArm,
    Modes,
    Scalar,
    ScalarLike,
    brief,
    closed_loop_modes,
    linearise,
    locked_frequencies,
    mass_matrix,
    one_off,
    scalar,
)

from .pd import PD
from .references import Move
from .shapers import CLASSICAL, Shaped, Shaper, unshaped

OSCILLATORY = 0.7  # a mode damped more than this does not ring


class Design(eqx.Module):
    """What is compared: a controller, the move it follows, and the shaper that smooths it."""

    controller: AbstractController
    move: Move
    shaper: Shaper

    __repr__ = brief

    @property
    def reference(self) -> Shaped:
        """The move through the shaper."""
        return Shaped(self.move, self.shaper)

    def move_time(self) -> Scalar:
        """Time [s] of the commanded move: that of the unshaped move plus that of the shaper."""
        return self.reference.end()


def textbook_pd(
    arm: Arm,
    pose: Float[Array, " joints"],
    bandwidth: ScalarLike | None = None,
    feedforward: bool = False,
) -> PD:
    """Critically damped PD for the rigid arm at `pose` [rad], joint by joint.

    Each joint is taken alone with the inertia J that it turns when the links are rigid,
    so that `J s^2 + (b + K_m K_b / R + K_m K_omega / R) s + K_m K_theta / R` has a
    double pole at `bandwidth` [rad/s]; without one given, at a third of the lowest
    frequency with the joints locked, so that the links hardly feel the controller (1 Hz
    where no link bends). A damping gain that back-EMF makes needless is zero.

    With `feedforward`, the voltage that the same rigid joint needs to follow the
    reference: `R b / K_m + K_b` on its rate and `R J / K_m` on its acceleration.
    """
    if bandwidth is None:
        locked = locked_frequencies(arm, pose)
        bandwidth = 2 * jnp.pi * (locked[0] / 3 if locked.shape[0] else 1.0)
    omega = scalar(bandwidth)
    return _textbook(arm.assemble(), pose, omega, feedforward)


@one_off
def _textbook(model: AssembledArm, pose: Float[Array, " joints"], omega: Scalar, feedforward: bool) -> PD:
    arm, n = model.arm, len(model.joints)
    inertia = jnp.diag(mass_matrix(model, jnp.zeros(model.size).at[:n].set(pose)))
    stiffness, damping, rate, acceleration = [], [], [], []
    for i, joint in enumerate(arm.joints):
        torque_gain, back_emf = scalar(1.0), scalar(0.0)
        if joint.motor is not None and arm.drive != "torque":
            torque_gain = joint.motor.joint_torque(scalar(1.0))
            if arm.drive == "voltage":
                torque_gain = torque_gain / joint.motor.resistance
                back_emf = joint.motor.back_emf_constant * joint.motor.gear_ratio
        rate.append(joint.viscous_friction / torque_gain + back_emf)
        acceleration.append(inertia[i] / torque_gain)
        stiffness.append(acceleration[i] * omega**2)
        damping.append(jnp.maximum(2 * acceleration[i] * omega - rate[i], 0.0))
    gains = (tuple(stiffness), tuple(damping))
    return PD(*gains, tuple(rate), tuple(acceleration)) if feedforward else PD(*gains)


def ringing_mode(
    arm: Arm, pose: Float[Array, " joints"], controller: AbstractController
) -> tuple[Scalar, Scalar]:
    """Frequency [Hz] and damping ratio of the mode that a classical shaper should cancel.

    The slowest mode of the closed loop at `pose` that rings at all, with a damping ratio
    below 0.7. Not for use under `jit`.

    **Raises** `NoRinging` if none rings.
    """
    modes = closed_loop_modes(linearise(arm, pose, controller, ()))
    rings, frequency, damping_ratio = _ringing(modes)
    if not rings:
        raise NoRinging("no mode of the closed loop rings: a shaper has nothing to cancel.")
    return frequency, damping_ratio


@one_off
def _ringing(modes: Modes) -> tuple[Bool[Array, ""], Scalar, Scalar]:
    """Whether a mode rings; frequency and damping ratio of the slowest that does."""
    rings = (modes.damping_ratio < OSCILLATORY) & (modes.frequency > 0)
    first = jnp.argmax(rings)
    return rings.any(), modes.frequency[first], jnp.maximum(modes.damping_ratio[first], 0.0)


class NoRinging(ValueError):
    """No mode of a loop rings, so there is none for a shaper to cancel."""


def classical_designs(
    arm: Arm, controller: AbstractController, move: Move, total_time: ScalarLike
) -> dict[str, Design]:
    """A design for every classical shaper with these gains, each lasting `total_time` [s].

    The shaper is designed for the slowest ringing mode of `arm` with its payload, at the
    end of the move; the move is then stretched or shortened so that with the shaper it
    lasts `total_time`. A shaper longer than nine tenths of that is left out, and
    all of them where no mode rings.
    """
    try:
        frequency, damping_ratio = ringing_mode(arm, jnp.stack(move.stop), controller)
    except NoRinging:
        return {}
    shapers = _shapers(tuple(CLASSICAL.values()), frequency, damping_ratio, scalar(total_time))
    return {
        name: Design(controller, with_duration(move, left), shaper)
        for name, (shaper, left) in zip(CLASSICAL, shapers, strict=True)
        if float(left) >= 0.1 * float(total_time)
    }


@one_off
def _shapers(makers: tuple, frequency: Scalar, damping_ratio: Scalar, total: Scalar):
    """Shapers of a mode, each with what it leaves of `total` [s] to the move."""
    shapers = [make(frequency, damping_ratio) for make in makers]
    return [(shaper, total - shaper.duration()) for shaper in shapers]


def with_duration(move: Move, duration: ScalarLike) -> Move:
    """The same move in another time [s]."""
    return eqx.tree_at(lambda m: m.duration, move, scalar(duration))


def unshaped_design(
    controller: AbstractController, move: Move, total_time: ScalarLike | None = None
) -> Design:
    """A controller alone, on the move as it is or stretched to `total_time` [s]."""
    if total_time is not None:
        move = with_duration(move, total_time)
    return Design(controller, move, unshaped())


@one_off
def stack(designs: list[Design], impulses: int = 1) -> Design:
    """Designs as one batched design, their shapers padded to the same number of impulses, `impulses` at least."""
    longest = max(impulses, *(design.shaper.delays.shape[0] for design in designs))
    padded = [eqx.tree_at(lambda d: d.shaper, design, design.shaper.padded(longest)) for design in designs]
    return jax.tree_util.tree_map(lambda *leaves: jnp.stack(leaves), *padded)


def default_move(arm: Arm) -> Move:
    """A move that makes the arm ring: 0.8 rad of the first joint, 0.5 rad of the others, quintic.

    It takes 1.1 periods of the lowest frequency with the joints locked, or longer where
    the rigid arm would need more than half of the voltage limit.
    """
    stop = tuple(0.8 if i == 0 else 0.5 for i in range(len(arm.joints)))
    pose = jnp.asarray(stop)
    locked = locked_frequencies(arm, pose)
    duration = 1.1 / locked[0] if locked.shape[0] else scalar(1.0)
    gains = textbook_pd(arm, pose, 1.0, feedforward=True)
    return Move((0.0,) * len(stop), stop, _slow_enough(arm, stop, gains, duration))


@one_off
def _slow_enough(arm: Arm, stop: tuple[float, ...], gains: PD, duration: Scalar) -> Scalar:
    """`duration` [s], or longer where the rigid arm would need more than half of the voltage limit."""
    for i, joint in enumerate(arm.joints):
        if joint.motor is None or joint.motor.voltage_limit is None or arm.drive != "voltage":
            continue
        # peaks of the quintic: rate 15/8 d/T, acceleration 10/sqrt(3) d/T^2; never more than the sum
        half = joint.motor.voltage_limit / 2
        rate = gains.rate_feedforward[i] * 15 / 8 * stop[i]
        acceleration = gains.acceleration_feedforward[i] * 10 / 3**0.5 * stop[i]
        needed = (rate + jnp.sqrt(rate**2 + 4 * half * acceleration)) / (2 * half)
        duration = jnp.maximum(duration, needed)
    return duration
