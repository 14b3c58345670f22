"""The driven joint in time: exact linear steps with kicks of everything else, at 20 kHz.

Between kicks the linear part moves exactly as its matrix exponential says; every 50 us the
rest (friction, contact, centrifugal and other forces) changes the rates by force times step.
Conservative forces keep their energy so, without drift. The trailing axis of every array is
the lane: many plants run side by side in one program, and an effect of size zero is absent.
"""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from .structure import COORDINATES, STATES

SAMPLE = 0.002  # s between samples, over which the voltage is held
DELAY_SLOTS = 24  # samples that the delay line holds
FILTER_RATE = 250.0  # rad/s of the filter of the controller's derivative
FORCED = ("motor", "hub", "frame", "tip", "deflection", "gravity")
COUNT = 2 * np.pi / 16384  # rad, one count of the encoder
CHANNELS = ("angle", "current", "tip_deflection", "rate", "strain")

FORCES = dict(
    # friction at the rotor: g(state) * bristle, the bristle bending over `presliding` rad
    dry=0.0, asymmetry=0.0, stribeck=0.0, stribeck_rate=0.2, presliding=5e-4,
    growth=0.0, patch=0.0, patch_angle=0.0, patch_width=0.1, load_friction=0.0,
    drag=0.0, ripple=0.0, ripple_order=8.0, ripple_phase=0.0,
    cable=0.0, cable_rest=0.0, load=0.0, backlash=0.0, contact=0.0, contact_damping=0.0,
    magnetic=0.0, warming=0.0, cooling=0.1,
    delay=0.0, limit=1e9, dead_zone=0.0,
    weight=0.0, weight_direction=0.0,
    hardening=0.0, stop=0.0, stop_place=1e9,
    stiffness=0.0, damping=0.0,
)  # fmt: skip
FAULTS = dict(gain=1.0, bias=0.0, drift=0.0, lag=0.0, quadratic=0.0, crosstalk=0.0)


def dot(a, b):
    return sum(a[k] * b[k] for k in range(len(a)))


def split(state):
    return state[0], state[1 : 1 + COORDINATES], state[1 + COORDINATES :]


def channels(plant, state):
    """Angle, current, tip deflection, rate and strain of a state, without any fault."""
    i, x, v = split(state)
    return (
        dot(plant["motor"], x),
        i,
        dot(plant["deflection"], x),
        dot(plant["motor"], v),
        dot(plant["strain"], x),
    )


def forces(plant, memory, time, disturbance, step):
    """All that acts beside the linear part, and what it remembers.

    `memory`: the state, the bristle [1], the spin momentum [N m s], the resistance added
    by heat [ohm]. Returns the forces in the order of `FORCED`, the square of the link's
    turning rate, the voltage lost, and the memory after `step`.
    """
    p, (state, bristle, momentum, heat) = plant, memory
    i, x, v = split(state)
    motor, motor_rate = dot(p["motor"], x), dot(p["motor"], v)
    hub, hub_rate = dot(p["hub"], x), dot(p["hub"], v)
    angle, spin = dot(p["frame"], x), dot(p["frame"], v)

    # friction: a bristle that bends, then slides
    level = p["dry"] * (1 + p["asymmetry"] * bristle) + p["growth"] * time
    level += p["stribeck"] / (1 + (motor_rate / p["stribeck_rate"]) ** 2)
    level += p["patch"] / (1 + ((motor - p["patch_angle"]) / p["patch_width"]) ** 4)
    level += p["load_friction"] * jnp.abs(p["torque_constant"] * i)
    bend = (bristle + step * motor_rate / p["presliding"]) / (
        1 + step * jnp.abs(motor_rate) / p["presliding"]
    )
    on_motor = -level * (bend + 1e-3 * (bend - bristle) / step) - p["drag"] * motor_rate * jnp.abs(motor_rate)
    on_motor -= p["ripple"] * jnp.sin(p["ripple_order"] * motor + p["ripple_phase"])

    # a winding whose field weakens with current, and that warms
    weak = 1 / (1 + p["magnetic"] * i * i) - 1
    on_motor += weak * p["torque_constant"] * i
    loss = heat * i + weak * p["back_emf_constant"] * motor_rate
    heat = heat + step * (p["warming"] * p["resistance"] * i * i - p["cooling"] * heat)

    on_hub = disturbance - p["cable"] * (hub - p["cable_rest"]) - p["load"]

    # rotor and hub touch on either side of the gap
    lag = motor - hub
    press = lag - jnp.clip(lag, -p["backlash"], p["backlash"])
    push = p["contact"] * press + jnp.where(press != 0, p["contact_damping"] * (motor_rate - hub_rate), 0.0)

    # the bent link holds angular momentum, and gives it back
    held = spin * sum(m * q * q for m, q in zip(p["mode"], x, strict=True))
    stop = -p["stop"] * jnp.maximum(dot(p["tip"], x) - p["stop_place"], 0.0)
    harden = -p["hardening"] * dot(p["deflection"], x) ** 3
    heading = angle + p["weight_direction"]
    weight = -p["weight"] * jnp.cos(heading)
    hanging = p["weight"] * jnp.sin(heading) * (dot(p["gravity"], x) - p["first_moment"] * angle)
    acting = (on_motor - push, on_hub + push, (momentum - held) / step + hanging, stop, harden, weight)
    return acting, spin * spin, loss, (bend, held, heat)


@partial(jax.jit, static_argnames=("substeps", "keep"))
def run(plant, start, reference, feedforward, disturbance, substeps, keep):
    """Simulate all lanes over the samples of `reference` [samples, lanes].

    The command is `feedforward` + PD on the encoder; `disturbance` [N m] acts on the hub.
    Returns, at each sample, the commanded voltage, the five channels as their sensors show
    them (the encoder not rounded), and every `keep`-th state.
    """
    step = SAMPLE / substeps
    follow = tuple(
        jnp.where(lag > 0, 1 - jnp.exp(-step / jnp.maximum(lag, 1e-9)), 1.0) for lag in plant["lag"]
    )
    whole = jnp.floor(plant["delay"] / SAMPLE)
    late = (plant["delay"] / SAMPLE - whole) * substeps
    lanes = jnp.arange(reference.shape[1])
    slot = whole.astype(int)

    def sample(carry, inputs):
        memory, shown, line, last_angle, filtered, time = carry
        wanted, wanted_rate, ahead, load, next_load = inputs
        read = tuple(
            plant["gain"][c] * y + plant["bias"][c] + plant["drift"][c] * time
            + plant["quadratic"][c] * y * y + plant["crosstalk"][c] * memory[0][0]
            for c, y in enumerate(shown)
        )  # fmt: skip
        counted = jnp.round(read[0] / COUNT) * COUNT
        decay = jnp.exp(-FILTER_RATE * SAMPLE)
        filtered = decay * filtered + (1 - decay) * (counted - last_angle) / SAMPLE
        command = (
            ahead + plant["stiffness"] * (wanted - counted) + plant["damping"] * (wanted_rate - filtered)
        )
        line = jnp.concatenate([command[None], line[:-1]])
        newer, older = line[slot, lanes], line[slot + 1, lanes]

        def substep(n, held):
            (state, *memory), shown = held
            voltage = older + (newer - older) * jnp.clip(n + 1 - late, 0.0, 1.0)
            voltage = jnp.clip(voltage, -plant["limit"], plant["limit"])
            voltage = voltage - jnp.clip(voltage, -plant["dead_zone"], plant["dead_zone"])
            now = load + (next_load - load) * (n / substeps)
            acting, whirl, loss, memory = jax.lax.cond(
                n >= 0,
                partial(forces, step=step),
                partial(forces, step=step),
                plant,
                (state, *memory),
                time + n * step,
                now,
            )
            moved = (*state, voltage - loss, *acting, *(whirl * q for q in split(state)[1]))
            state = tuple(sum(plant["step"][k, j] * m for j, m in enumerate(moved)) for k in range(STATES))
            true = channels(plant, state)
            shown = tuple(s + f * (y - s) for s, f, y in zip(shown, follow, true, strict=True))
            return (state, *memory), shown

        kept = jnp.stack(memory[0])
        memory, shown = jax.lax.fori_loop(0, substeps, substep, (memory, shown))
        return (memory, shown, line, counted, filtered, time + SAMPLE), (command, jnp.stack(read), kept)

    slope = jnp.gradient(reference, SAMPLE, axis=0)
    nothing = jnp.zeros_like(reference[0])
    state = tuple(start[k] for k in range(STATES))
    _, x, v = split(state)
    momentum = dot(plant["frame"], v) * sum(m * q * q for m, q in zip(plant["mode"], x, strict=True))
    begin = channels(plant, state)
    line = jnp.zeros((DELAY_SLOTS, reference.shape[1]))
    carry = ((state, nothing, momentum, nothing), begin, line, begin[0], nothing, 0.0)
    ahead = jnp.concatenate([disturbance[1:], disturbance[-1:]])
    _, (voltage, read, states) = jax.lax.scan(
        sample, carry, (reference, slope, feedforward, disturbance, ahead)
    )
    return voltage, read, states[::keep]
