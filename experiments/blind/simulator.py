"""The loop around a plant: sampled PD control on encoders, delay line, sensors with faults, 20 kHz.

The trailing axis of every array is the lane: many plants run side by side in one program, and an
effect of size zero is absent. `plant` holds `joint` (laws, motor and gains, [joints, lanes]), `fault`
(of the sensors, [channels, joints, lanes]) and `arm` (everything else). The mechanics are a module of
functions (see `one_link` and `two_link`):
`begin(plant, start)` makes its memory, `advance(plant, memory, time, voltage, disturbance, step)`
moves it on, `channels(plant, memory)` reads its joints, `state(memory)` is what `begin` takes.
"""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from .joint import amplifier

SAMPLE = 0.002  # s between samples, over which the voltage is held
DELAY_SLOTS = 24  # samples that the delay line holds
FILTER_RATE = 250.0  # rad/s of the filter of the controller's derivative
COUNT = 2 * np.pi / 16384  # rad, one count of the encoder
CHANNELS = ("angle", "current", "tip_deflection", "rate", "strain")
ARM = dict(gravity_field=0.0, gravity_direction=0.0, stop=0.0, stop_place=1e9)
FAULTS = dict(gain=1.0, bias=0.0, drift=0.0, lag=0.0, quadratic=0.0, crosstalk=0.0)


def dot(a, b):
    """Sum of the products of two sequences."""
    return sum(a[k] * b[k] for k in range(len(a)))


def settled(function, flag, *args):
    """`function(*args)`, computed once: XLA would otherwise repeat it in every use of its results.

    `flag` must be true, without the compiler knowing.
    """
    return jax.lax.cond(flag, function, function, *args)


@partial(jax.jit, static_argnames=("physics", "substeps", "keep"))
def run(physics, plant, start, reference, feedforward, disturbance, substeps, keep):
    """Simulate all lanes over the samples of `reference` [samples, joints, lanes].

    The command is `feedforward` + PD on the encoders; `disturbance` [N m] acts on the hubs.
    Returns, at each sample, the commanded voltages, the channels [samples, channel, joint, lane]
    as their sensors show them (the encoders not rounded), and every `keep`-th state.
    """
    step = SAMPLE / substeps
    joints = range(reference.shape[1])
    lanes = jnp.arange(reference.shape[2])
    p, fault = plant["joint"], plant["fault"]
    follow = jnp.where(fault["lag"] > 0, 1 - jnp.exp(-step / jnp.maximum(fault["lag"], 1e-9)), 1.0)
    whole = jnp.floor(p["delay"] / SAMPLE)
    late = (p["delay"] / SAMPLE - whole) * substeps
    slot = whole.astype(int)
    decay = jnp.exp(-FILTER_RATE * SAMPLE)

    def sample(carry, inputs):
        memory, shown, line, last_angle, filtered, time = carry
        wanted, wanted_rate, ahead, load, next_load = inputs
        lagged = jnp.stack([jnp.stack(c) for c in shown])
        read = fault["gain"] * lagged + fault["bias"] + fault["drift"] * time
        read += fault["quadratic"] * lagged**2 + fault["crosstalk"] * lagged[CHANNELS.index("current")]
        counted = jnp.round(read[0] / COUNT) * COUNT
        filtered = decay * filtered + (1 - decay) * (counted - last_angle) / SAMPLE
        command = ahead + p["stiffness"] * (wanted - counted) + p["damping"] * (wanted_rate - filtered)
        line = jnp.concatenate([command[None], line[:-1]])
        newer = [line[slot[j], j, lanes] for j in joints]
        older = [line[slot[j] + 1, j, lanes] for j in joints]

        def substep(n, held):
            memory, shown = held
            arrived = [jnp.clip(n + 1 - late[j], 0.0, 1.0) for j in joints]
            voltage = tuple(
                amplifier(
                    {k: p[k][j] for k in ("limit", "dead_zone")},
                    older[j] + (newer[j] - older[j]) * arrived[j],
                )
                for j in joints
            )
            now = tuple(load[j] + (next_load[j] - load[j]) * (n / substeps) for j in joints)
            memory = physics.advance(plant, memory, time + n * step, voltage, now, step, n >= 0)
            true = physics.channels(plant, memory)
            shown = tuple(
                tuple(shown[c][j] + follow[c, j] * (true[c][j] - shown[c][j]) for j in joints)
                for c in range(len(CHANNELS))
            )
            return memory, shown

        kept = jnp.stack(physics.state(memory))
        memory, shown = jax.lax.fori_loop(0, substeps, substep, (memory, shown))
        return (memory, shown, line, counted, filtered, time + SAMPLE), (command, read, kept)

    slope = jnp.gradient(reference, SAMPLE, axis=0)
    memory = physics.begin(plant, start)
    shown = physics.channels(plant, memory)
    line = jnp.zeros((DELAY_SLOTS, *reference.shape[1:]))
    carry = (memory, shown, line, jnp.stack(shown[0]), jnp.zeros_like(reference[0]), 0.0)
    ahead = jnp.concatenate([disturbance[1:], disturbance[-1:]])
    _, (voltage, read, states) = jax.lax.scan(
        sample, carry, (reference, slope, feedforward, disturbance, ahead)
    )
    return voltage, read, states[::keep]
