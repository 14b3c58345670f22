"""Iterative learning of a feedforward: the same move again and again, each time better.

A move of N samples is one vector. Of the linear loop, the errors of the joints are
`e = e_0 - G f` with f the feedforward and G its impulse response, lower triangular. The
next trial's f is the least of `|e - G (f' - f)|^2 + lambda |f' - f|^2 + mu |f'|^2` with
respect to f' (norm-optimal learning, Amann, Owens and Rogers 1996; with a weight on the
command itself as in Gunnarsson and Norrlof 2001): `f' = Q f + L e`, where

    L = (G'G + (lambda + mu) I)^-1 G'      Q = (G'G + (lambda + mu) I)^-1 (G'G + lambda I)

On an arm whose response is G, f comes closer to where it settles by
`lambda / (lambda + mu + sigma^2)` a trial for every singular value sigma of G. On one whose
response is H, trials settle if every eigenvalue of `Q - L H` lies within the unit circle:
with mu zero that fails as soon as G and H part by a quarter turn or more at some
frequency, as they do between a resonance and where the model puts it.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PyTree

from jaxflex import (
    AbstractController,
    AbstractMethod,
    AbstractReference,
    Arm,
    InitialState,
    Measurement,
    Scalar,
    ScalarLike,
    Setpoint,
    cut_loop,
    scalar,
    simulate,
)

from .compose import Sum, ZeroOrderHold

Table = Float[Array, "samples joints"]


class Replayed(AbstractController):
    """Commands from a table, `values[k]` from `k interval` [s] on; zero after its end."""

    values: Table
    interval: Scalar = eqx.field(converter=scalar)

    def period(self) -> Scalar | None:
        """The interval [s]."""
        return self.interval

    def initial(self) -> PyTree:
        """No memory."""
        return None

    def command(
        self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint
    ) -> tuple[Scalar, ...]:
        """The row of the table that is due."""
        index = jnp.round(t / self.interval).astype(int)
        due = index < self.values.shape[0]
        row = self.values[jnp.clip(index, 0, self.values.shape[0] - 1)]
        return tuple(jnp.where(due, row, 0.0))

    def rate(self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint) -> PyTree:
        """No memory."""
        return None


def impulse_response(
    arm: Arm, pose: Float[Array, " joints"], controller: AbstractController, samples: int
) -> Float[Array, "errors commands"]:
    """G: joint angles at samples 1 to N from feedforward at samples 0 to N-1, samples by joints.

    `controller` is sampled; the loop is that made linear about rest at `pose` [rad].

    **Raises** `ValueError` for a controller without a period.
    """
    if controller.period() is None:
        raise ValueError("learning goes from sample to sample: wrap the controller in ZeroOrderHold.")
    loop = cut_loop(arm, pose, controller)
    joints = loop.B.shape[1]
    around = loop.closed()

    def step(x, _):
        return around @ x, x[:joints]  # the angles come first in the state

    _, response = jax.lax.scan(step, loop.B, None, length=samples)
    lag = jnp.arange(samples)[:, None] - jnp.arange(samples)[None, :]
    blocks = jnp.where((lag >= 0)[..., None, None], response[jnp.clip(lag, 0)], 0.0)
    return blocks.transpose(0, 2, 1, 3).reshape(samples * joints, samples * joints)


class LearningGain(NamedTuple):
    """What a trial teaches: the next feedforward is `memory f + correction e`."""

    correction: Float[Array, "commands errors"]
    memory: Float[Array, "commands commands"]


def learning_gain(
    response: Float[Array, "errors commands"], caution: ScalarLike, forgetting: ScalarLike = 0.0
) -> LearningGain:
    """L and Q, with `sqrt(lambda)` the share `caution` of G's largest singular value, and mu `forgetting` lambda.

    Without forgetting every trial of the very arm of `response` is better than the one
    before. Of an arm that is only like it, errors fall at first and may creep up again;
    0.3 or so holds them down, at the price of a small error that stays.
    """
    scale = (scalar(caution) * jnp.linalg.norm(response, 2)) ** 2
    gram, unit = response.T @ response, jnp.eye(response.shape[1])
    weighed = gram + (1 + scalar(forgetting)) * scale * unit
    return LearningGain(jnp.linalg.solve(weighed, response.T), jnp.linalg.solve(weighed, gram + scale * unit))


class Learned(NamedTuple):
    """`feedforward` of the best trial, and the rms error [rad] of the joints in every trial, first to last."""

    feedforward: Replayed
    errors: Float[np.ndarray, " trials"]


def learn(
    arm: Arm,
    controller: AbstractController,
    reference: AbstractReference,
    gain: LearningGain,
    interval: ScalarLike,
    trials: int = 8,
    method: AbstractMethod | None = None,
) -> Learned:
    """Run the move `trials` times on `arm`, its feedforward better each time.

    `gain` is the `learning_gain` of a model; `arm` is the one that learns, and need not
    be that model. The best trial is the one kept. The arm begins each trial at rest where
    the reference begins.

    **Raises** `SimulationError` if a trial fails, as when model and arm differ so much
    that learning diverges.
    """
    joints = len(arm.joints)
    samples = gain.correction.shape[0] // joints
    times = scalar(interval) * jnp.arange(samples + 1)
    start = InitialState(angles=jnp.stack(reference(times[0])))
    wanted = jnp.stack(jax.vmap(reference)(times), axis=-1)
    names = [f"angle_{i + 1}" for i in range(joints)]

    @eqx.filter_jit
    def trial(table):
        law = ZeroOrderHold(Sum((controller, Replayed(table, interval))), interval)
        run = simulate(arm, law, reference, times, initial=start, method=method, channels=names)
        error = (wanted - jnp.stack([run[name] for name in names], axis=-1))[1:]
        after = gain.memory @ table.ravel() + gain.correction @ error.ravel()
        return run, error, after.reshape(table.shape)

    table, errors = jnp.zeros((samples, joints)), []
    best = table
    for _ in range(trials):
        run, error, after = trial(table)
        run.check()
        errors.append(float(jnp.sqrt(jnp.mean(error**2))))
        if errors[-1] == min(errors):
            best = table
        table = after
    return Learned(Replayed(best, interval), np.asarray(errors))
