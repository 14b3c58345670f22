"""Linear quadratic control of the arm made linear, its state estimated from instruments."""

from collections.abc import Mapping
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, PyTree

from jaxflex import (
    AbstractController,
    Arm,
    LinearModel,
    Measurement,
    Scalar,
    ScalarLike,
    Setpoint,
    held,
    linearise,
    optional_scalar,
    scalar,
)

from .riccati import kalman_gain, lqr_gain

READABLE = ("angle", "rate", "current", "tip_deflection", "curvature", "curvature_rate", "strain")


class Path(NamedTuple):
    """What the linear arm does to follow a slow reference, per unit of its value, rate and acceleration.

    `state` `(states, 3 joints)` and `command` `(joints, 3 joints)`: with x = X0 r + X1 r'
    + X2 r'' and u alike, `x' = A x + B u` holds but for r''' and the joints are at r. The
    links are bent as the acceleration bends them, quasi-statically. It inverts the arm
    at its joints; inverted at its tip it would need the future, since there it is not
    minimum-phase.
    """

    state: Float[Array, "states references"]
    command: Float[Array, "joints references"]


def following(linear: LinearModel) -> Path:
    """The `Path` of an open loop whose first channels are the joint angles."""
    n, m = linear.B.shape
    angles = linear.C[:m]
    whole = jnp.block([[linear.A, linear.B], [angles, jnp.zeros((m, m))]])
    before, states, commands = jnp.zeros((n, m)), [], []
    for order in range(3):
        wanted = jnp.eye(m) if order == 0 else jnp.zeros((m, m))
        both = jnp.linalg.solve(whole, jnp.concatenate([before, wanted]))
        before = both[:n]
        states.append(both[:n])
        commands.append(both[n:])
    return Path(jnp.concatenate(states, axis=1), jnp.concatenate(commands, axis=1))


class LQG(AbstractController):
    """`u = u_d - K (x^ - x_d)` with x^ from a Kalman filter, about a `pose`.

    `x^' = A x^ + B u + L (y - C x^)`, or from sample to sample if it has an `interval`
    (a predictor: the command does not wait for the reading). Made by `lqg`; K and L are
    parameters like any other, and may be tuned.

    **Fields**: the model `A`, `B`, `C`; `feedback` K; `observer` L; `path`, which gives
    x_d and u_d from the reference; `pose` [rad]; `sensors`, channels read; `interval` [s].
    """

    A: Float[Array, "states states"]
    B: Float[Array, "states joints"]
    C: Float[Array, "outputs states"]
    feedback: Float[Array, "joints states"]
    observer: Float[Array, "states outputs"]
    path: Path
    pose: Float[Array, " joints"]
    sensors: tuple[str, ...] = eqx.field(static=True)
    interval: Scalar | None = eqx.field(converter=optional_scalar, default=None)

    def period(self) -> Scalar | None:
        """The interval [s], None if continuous."""
        return self.interval

    def initial(self) -> PyTree:
        """The estimate, `(states,)`: at rest at the pose."""
        return jnp.zeros(self.A.shape[0])

    def begin(self, measurement: Measurement) -> PyTree:
        """The estimate: at rest and undeflected where the joints are."""
        joints = self.pose.shape[0]
        away = jnp.stack(measurement.angle) - self.pose
        return self.path.state[:, :joints] @ away

    def _reference(self, setpoint: Setpoint) -> Float[Array, " references"]:
        value = jnp.stack(setpoint.value) - self.pose
        return jnp.concatenate([value, jnp.stack(setpoint.rate), jnp.stack(setpoint.acceleration)])

    def _command(self, estimate, setpoint):
        wanted = self._reference(setpoint)
        away = estimate - self.path.state @ wanted
        return self.path.command @ wanted - self.feedback @ away

    def command(
        self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint
    ) -> tuple[Scalar, ...]:
        """Command of every joint."""
        return tuple(self._command(memory, setpoint))

    def _predicted(self, memory, measurement, setpoint):
        readings = []
        for name in self.sensors:
            kind, _, number = name.rpartition("_")
            value = getattr(measurement, kind)[int(number) - 1]
            readings.append(value - self.pose[int(number) - 1] if kind == "angle" else value)
        surprise = jnp.stack(readings) - self.C @ memory
        return self.A @ memory + self.B @ self._command(memory, setpoint) + self.observer @ surprise

    def rate(self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint) -> PyTree:
        """Rate of the estimate."""
        if self.interval is not None:
            raise ValueError("a sampled LQG has no rate: simulate it sampled, as it is by default.")
        return self._predicted(memory, measurement, setpoint)

    def advance(
        self, period: Scalar, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint
    ) -> PyTree:
        """The estimate one sample later."""
        if self.interval is None:
            raise ValueError("a continuous LQG under sampled control: make it with lqg(…, period=…).")
        return self._predicted(memory, measurement, setpoint)


def lqg(
    arm: Arm,
    pose: Float[Array, " joints"],
    cost: Mapping[str, ScalarLike],
    effort: ScalarLike,
    sensors: Mapping[str, ScalarLike],
    disturbance: ScalarLike,
    period: ScalarLike | None = None,
) -> LQG:
    """LQR gains and a Kalman filter for `arm` about rest at `pose` [rad].

    - `cost`: channel to the deviation of it that weighs as much as a command of
      `effort` (in the unit of the command); `Q = sum c c' / deviation^2`, `R = I / effort^2`
    - `sensors`: channel read to its noise, as a density [unit / sqrt(Hz)], such as
      `{"angle_1": 1e-5, "curvature_1": 1e-4}`; of `angle`, `rate`, `current`,
      `tip_deflection`, `curvature`, `curvature_rate` and `strain`
    - `disturbance`: noise on the commands [unit of the command / sqrt(Hz)], which stands for all
      that the model does not know: more of it makes the filter trust its sensors more
    - `period` [s]: for a sampled law, designed for commands that are held

    **Raises** `ValueError` for a sensor that no controller can read; an error where the
    angles are neither sensed nor in the cost.
    """
    for name in sensors:
        if name.rpartition("_")[0] not in READABLE:
            raise ValueError(
                f"sensors: {name!r} cannot be read; allowed are {', '.join(READABLE)}, with the "
                "number of the joint or link, such as 'angle_1'."
            )
    joints = len(arm.joints)
    names = (*(f"angle_{i + 1}" for i in range(joints)), *cost, *sensors)
    linear = linearise(arm, pose, channels=names)
    a, b = linear.A, linear.B
    weighed = linear.C[joints : joints + len(cost)] / jnp.stack([scalar(v) for v in cost.values()])[:, None]
    read = linear.C[joints + len(cost) :]
    q, r = weighed.T @ weighed, jnp.eye(joints) / scalar(effort) ** 2
    w = scalar(disturbance) ** 2 * b @ b.T
    v = jnp.diag(jnp.stack([scalar(x) for x in sensors.values()]) ** 2)
    path, interval = following(linear), optional_scalar(period)
    if interval is not None:
        # white noise averaged over a sample; a cost summed over samples
        a, b = held(a, b, interval)
        q, r, v = q * interval, r * interval, v / interval
        w = scalar(disturbance) ** 2 / interval * b @ b.T
    # a trace of noise on every state: what no command stirs must not be believed for ever
    w = w + 1e-12 * jnp.trace(w) / w.shape[0] * jnp.eye(w.shape[0])
    k, observer = lqr_gain(a, b, q, r, interval), kalman_gain(a, read, w, v, interval)
    return LQG(a, b, read, k, observer, path, jnp.asarray(pose), tuple(sensors), interval)
