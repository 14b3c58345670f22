"""What the paper leaves unsaid: choices to be enumerated, and numbers to be found by gradient."""

from typing import NamedTuple

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

import controllers as ctl
import jaxflex as jf

DURATION, TORQUE, WIDTH = 5.0, 0.2, 1.0  # s, N m, s


class Choice(NamedTuple):
    """The choices that are not numbers.

    `joints`: which are driven; `shapes`: mode shapes of the links; `frozen`: the
    equations made linear about the stretched arm, or not; `early`: settling looked at
    until the torque ends and towards the angle there, or over the whole run.
    """

    joints: tuple[float, float]
    shapes: str
    frozen: bool
    early: bool = False

    def __str__(self) -> str:
        driven = {(1.0, 1.0): "both joints driven", (1.0, 0.0): "first driven", (0.0, 1.0): "second driven"}
        model = "linear" if self.frozen else "nonlinear"
        end = "the torque" if self.early else "the run"
        return f"{driven[self.joints]}, {self.shapes}, {model}, settling by the end of {end}"


PRINTED = Choice((1.0, 1.0), "clamped_tip_mass", False)
CHOICES = [
    Choice(joints, shapes, frozen)
    for joints in ((1.0, 1.0), (1.0, 0.0), (0.0, 1.0))
    for shapes in ("clamped_tip_mass", "distal_mass_and_moment")
    for frozen in (False, True)
]

# name: value as printed (or taken, where nothing is), lowest and highest that are searched
NUMBERS = {
    "hub inertia at the absolute rate, joint 1 [kg m^2]": (0.02, 1e-4, 0.5),
    "hub inertia at the absolute rate, joint 2 [kg m^2]": (0.02, 1e-4, 0.5),
    "rotor inertia at the relative rate, joint 2 [kg m^2]": (1e-4, 1e-4, 0.5),
    "payload inertia about the tip [kg m^2 per kg]": (1e-4, 1e-4, 0.25),
    "damping D / sqrt(K) [sqrt(kg)]": (0.1, 1e-3, 10.0),
    "mass of the centre motor [kg]": (1.0, 0.01, 3.0),
    "viscous friction of the joints [N m s/rad]": (1e-5, 1e-5, 0.3),
    "torque of the second joint over that of the first [1]": (1.0, 0.2, 5.0),
}


def domain() -> ctl.Interval:
    """The range of every number."""
    table = np.array(list(NUMBERS.values()))
    return ctl.Interval(jnp.asarray(table[:, 1]), jnp.asarray(table[:, 2]))


def printed() -> Float[Array, " numbers"]:
    """The numbers as printed."""
    return jnp.asarray(np.array(list(NUMBERS.values()))[:, 0])


def arm_of(choice: Choice, numbers: Float[Array, " numbers"], payload) -> jf.Arm:
    """The arm with these assumptions, carrying `payload` [kg]."""
    hub_1, hub_2, rotor_2, spread, damping, centre, friction, _ = numbers
    # D = c sqrt(K) with a modal mass of m is a damping ratio of c / (2 sqrt(m))
    link = jf.Link(0.5, 0.2, 1.0, damping_ratio=damping / (2 * jnp.sqrt(0.1)), mode_shapes=choice.shapes)
    joints = (
        jf.Joint(hub_inertia=hub_1, viscous_friction=friction),
        jf.Joint(hub_inertia=hub_2, hub_mass=centre, viscous_friction=friction, rotor_inertia=rotor_2),
    )
    return jf.Arm((link, link), joints, jf.Payload(payload, spread * payload))


def bang_bang(choice: Choice, numbers: Float[Array, " numbers"]) -> ctl.BangBang:
    """The torque [N m] of both joints."""
    return ctl.BangBang((TORQUE * choice.joints[0], TORQUE * choice.joints[1] * numbers[-1]), WIDTH)


def angles(choice: Choice, numbers: Float[Array, " numbers"], payload, dt: float) -> Float[Array, "2 times"]:
    """Both joint angles [rad] every `dt` [s], by classical Runge-Kutta steps of `dt`."""
    arm = arm_of(choice, numbers, payload)
    count = round(DURATION / dt)
    if choice.frozen:
        return _frozen(arm, bang_bang(choice, numbers), dt, count)
    run = jf.simulate(
        arm,
        ctl.OpenLoop(),
        bang_bang(choice, numbers),
        jnp.linspace(0.0, DURATION, count + 1),
        method=jf.Fixed(dt, jf.RungeKutta4()),
        channels=["angle_1", "angle_2"],
        adjoint=diffrax.ForwardMode(),
    )
    return jnp.stack([run["angle_1"], run["angle_2"]])


def _frozen(arm: jf.Arm, torque: ctl.BangBang, dt: float, count: int) -> Float[Array, "2 times"]:
    """The arm linear about its stretched pose, whose steps are exact under a torque held over them."""
    linear = jf.linearise(arm, jnp.zeros(2), None, ("angle_1", "angle_2"))
    states = linear.A.shape[0]
    block = jnp.zeros((states + 2, states + 2)).at[:states].set(jnp.hstack([linear.A, linear.B]))
    step = jax.scipy.linalg.expm(dt * block)[:states]

    def advance(x, t):
        push = jnp.stack(torque(t + dt / 2))
        x = step @ jnp.concatenate([x, push])
        return x, linear.C @ x

    _, out = jax.lax.scan(advance, jnp.zeros(states), dt * jnp.arange(count))
    return jnp.concatenate([jnp.zeros((1, 2)), out]).T
