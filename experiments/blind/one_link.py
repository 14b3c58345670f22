"""One driven joint with a link, a payload, or an inertia alone: exact linear steps under held forces.

The linear part (`structure`) moves exactly as its matrix exponential says. All else (friction,
contact, centrifugal and other forces) is held over a step at what it is halfway, where half a step
under the forces at its beginning leads: an exponential midpoint rule, of second order but for what
changes the momentum of the bent link, which lags by half a step.
"""

from collections.abc import Mapping
from functools import partial

import jax.numpy as jnp
import numpy as np
import scipy.linalg

from .joint import contact, friction, winding
from .simulator import SAMPLE, dot, settled
from .structure import COORDINATES, STATES, structure

FORCED = ("motor", "hub", "frame", "tip", "deflection", "gravity")
ROWS = (*FORCED, "strain", "mode")
REPLAY = 10  # steps a sample that suffice where no friction acts


def prepare(body: Mapping[str, np.ndarray], step: float) -> dict[str, np.ndarray]:
    """Arrays that `advance` needs for a body."""
    s = structure(body)
    arrays = {k: s[k] for k in (*ROWS, "first_moment")}
    outward = np.diag(s["mode"]) - body["foreshortening"][0] * s["tension"]
    half, whole = (exact_step(s, outward, h) for h in (step / 2, step))
    return arrays | {"outward": outward, "half": half, "whole": whole}


def exact_step(s: Mapping[str, np.ndarray], outward: np.ndarray, step: float):
    """[state, voltage, forces, coordinates x rate squared] -> state after `step` [s].

    All but the state is held, a force along one of the rows FORCED. The last columns are what a
    turning link feels: its modes are thrown `outward`, and stiffened where it is shorter as it bends.
    """
    along = np.concatenate([np.stack([s[name] for name in FORCED], axis=1), outward], axis=1)
    pushed = np.zeros((STATES, along.shape[1]))
    pushed[1 + COORDINATES :] = s["mobility"] @ along
    rows = np.concatenate([s["system"], pushed], axis=1)
    block = np.zeros((rows.shape[1], rows.shape[1]))
    block[:STATES] = rows
    return scipy.linalg.expm(block * step)[:STATES]


def split(state):
    """Current, coordinates and rates."""
    return state[0], state[1 : 1 + COORDINATES], state[1 + COORDINATES :]


def held_by_bending(p, x, v):
    """Angular momentum [N m s] that the link has because it is bent."""
    inertia = sum(q * dot(row, x) for row, q in zip(p["outward"], x, strict=True))
    return dot(p["frame"], v) * inertia


def begin(plant, start):
    """Memory: state, bristle [1], momentum of the bent link [N m s], resistance added by heat [ohm]."""
    state = tuple(start[k] for k in range(STATES))
    _, x, v = split(state)
    nothing = jnp.zeros_like(start[0])
    held = held_by_bending(plant["arm"], x, v)
    return state, nothing, held, nothing


def state(memory):
    """What `begin` takes."""
    return memory[0]


def channels(plant, memory):
    """Angle, current, tip deflection, rate and strain of the joint, without any fault."""
    p, (i, x, v) = plant["arm"], split(memory[0])
    angle, rate = dot(p["motor"], x), dot(p["motor"], v)
    return (angle,), (i,), (dot(p["deflection"], x),), (rate,), (dot(p["strain"], x),)


def forces(plant, memory, state, time, disturbance, step):
    """Forces along the rows FORCED, the square of the link's rate, the voltage lost, and memory after `step`.

    They are those in a `state`, and at a `time`, in the course of the step that begins with `memory`; the
    momentum there is what the link held halfway through the step before.
    """
    p = {k: v[0] for k, v in plant["joint"].items()} | plant["arm"]
    _, bristle, momentum, heat = memory
    i, x, v = split(state)
    motor, motor_rate = dot(p["motor"], x), dot(p["motor"], v)
    hub, hub_rate = dot(p["hub"], x), dot(p["hub"], v)
    angle, spin = dot(p["frame"], x), dot(p["frame"], v)

    resisting, bristle = friction(p, motor, motor_rate, i, bristle, time, step)
    weakening, loss, heat = winding(p, motor_rate, i, heat, step)
    push = contact(p, motor - hub, motor_rate - hub_rate)
    on_motor = resisting + weakening - push
    on_hub = disturbance + push - p["cable"] * (hub - p["cable_rest"]) - p["load"]

    # the bent link holds angular momentum, and gives it back; its weight hangs beside its axis
    held = held_by_bending(p, x, v)
    heading = angle + p["gravity_direction"]
    sideways = dot(p["gravity"], x) - p["first_moment"] * angle
    on_frame = (momentum - held) / step + p["gravity_field"] * jnp.sin(heading) * sideways
    weight = -p["gravity_field"] * jnp.cos(heading)
    stop = -p["stop"] * jnp.maximum(dot(p["tip"], x) - p["stop_place"], 0.0)
    harden = -p["hardening"] * dot(p["deflection"], x) ** 3
    acting = (on_motor, on_hub, on_frame, stop, harden, weight)
    return acting, spin * spin, loss, (bristle, held, heat)


def advance(plant, memory, time, voltage, disturbance, step, flag):
    """One step of `step` [s]."""
    begin = memory[0]

    def onward(name, state, when, span):
        acting, whirl, loss, after = settled(
            partial(forces, step=span), flag, plant, memory, state, when, disturbance[0]
        )
        given = (*begin, voltage[0] - loss, *acting, *(whirl * q for q in split(state)[1]))
        flow = plant["arm"][name]
        return tuple(sum(flow[k, j] * m for j, m in enumerate(given)) for k in range(STATES)), *after

    middle, *_ = onward("half", begin, time, step / 2)
    return onward("whole", middle, time + step / 2, step)


def readings(s: Mapping[str, np.ndarray]) -> np.ndarray:
    """Rows [channel, STATES] of angle, current, tip deflection, rate and strain."""
    rows = np.zeros((5, STATES))
    x, v = slice(1, 1 + COORDINATES), slice(1 + COORDINATES, STATES)
    rows[0, x], rows[1, 0], rows[2, x] = s["motor"], 1.0, s["deflection"]
    rows[3, v], rows[4, x] = s["motor"], s["strain"]
    return rows


def transition(system: np.ndarray) -> np.ndarray:
    """[state, voltage] -> state a sample later, the voltage held."""
    block = np.zeros((STATES + 1, STATES + 1))
    block[:STATES] = system
    return scipy.linalg.expm(block * SAMPLE)[:STATES]


def translation(home: Mapping[str, np.ndarray], guest: Mapping[str, np.ndarray]) -> np.ndarray:
    """State of the body `guest` -> state of `home`, which has rigid connections, by angle and modes."""
    here, there = structure(home), structure(guest)
    place = np.zeros((COORDINATES, COORDINATES))
    place[0] = there["motor"]
    for row, column in zip(np.flatnonzero(here["mode"]), np.flatnonzero(there["mode"]), strict=False):
        place[row, column] = 1.0
    out = np.zeros((STATES, STATES))
    out[0, 0] = 1.0
    x, v = slice(1, 1 + COORDINATES), slice(1 + COORDINATES, STATES)
    out[x, x] = out[v, v] = place
    return out


def linear_sensitivities(bodies, voltage: np.ndarray, start: np.ndarray, scale: np.ndarray):
    """Readings over the noise `scale` [channels, joints] of each of `bodies`, without the forces.

    Returns, over [samples, channels x joints] flattened, the answer to every initial state of the
    first body, the same in all segments, [1, size, states], and each body's own motion under
    `voltage` [samples, joints, segments] from `start` [states, segments], [bodies, segments, size].
    """
    structures = [structure(b) for b in bodies]
    used = np.flatnonzero(np.abs(structures[0]["system"]).sum(axis=1) > 0)
    pick = np.flatnonzero(np.isfinite(scale[:, 0]))
    rows = np.stack([readings(s)[pick][:, used] for s in structures]) / scale[pick]
    flow = np.stack([transition(s["system"]) for s in structures])
    step, push = flow[:, used][:, :, used], flow[:, used, STATES:]
    free, state = np.eye(len(used)), np.repeat(start[None, used], len(structures), axis=0)
    released, motions = [], []
    for volts in voltage[:, 0]:
        released.append(rows[0] @ free)
        motions.append(rows @ state)
        free, state = step[0] @ free, step @ state + push * volts
    size = len(voltage) * len(pick)
    motion = np.stack(motions).transpose(1, 3, 0, 2).reshape(len(structures), -1, size)
    return np.stack(released).reshape(1, size, -1), motion
