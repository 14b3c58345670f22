"""Two flexible links with a motor at each joint: articulated bodies in floating frames.

                          q_2
        frame 1  --~~~--(2)--~~~-- payload        each link bends in modes seen from axes at
       (1)          q_1                           its root; the tip of link 1 carries joint 2

Link 2, held at its root, answers an acceleration A of that root with a force L A + l. Solved
for the acceleration of the tip of link 1 that this leaves, everything else follows outwards.
Positions move half a step, rates a whole one under forces taken at the middle, and positions
the other half. Hub masses and inertias belong to the links, a hub inertia to the link it drives;
where a joint is flexible or has play, a share of it becomes a rotor with a motion of its own.
"""

from collections.abc import Mapping
from functools import partial

import jax.numpy as jnp
import numpy as np

from .beam import clamped_beam
from .joint import contact, friction, winding
from .simulator import dot, settled
from .structure import ROTOR_SHARE, SPRING_DAMPING

MODES = 3  # a link
REPLAY = 5  # steps a sample that suffice where no friction acts
COORDINATES = 2 * (2 + MODES)  # angles of rotors, of hubs (relative), modes of link 1, of link 2
STATES = 2 + 2 * COORDINATES  # currents, coordinates, their rates
MASSES = ("inertia", "first_moment", "mass", "coupling", "weight", "tip", "tip_slope")


def prepare(body: Mapping[str, np.ndarray], step: float) -> dict[str, np.ndarray]:
    """Arrays that `advance` needs for a body (parameters a joint)."""
    rho = body["density"] * body["width"] * body["thickness"]
    rigidity = body["youngs_modulus"] * body["width"] * body["thickness"] ** 3 / 12
    tips = (
        (body["hub_mass"][1], 0.0, rho[1] * body["length"][1] + body["payload_mass"][0]),
        (body["payload_mass"][0], body["payload_inertia"][0], 0.0),
    )
    loose = (body["joint_compliance"] > 0) | (body["backlash"] > 0)
    rotor = ROTOR_SHARE * body["hub_inertia"]
    flexible = body["joint_compliance"] > 0
    spring = np.where(flexible, 1 / np.where(flexible, body["joint_compliance"], 1.0), 0.0)
    out = {
        "length": body["length"],
        "rotor": np.where(loose, rotor, 0.0),
        "hub": np.where(loose, body["hub_inertia"] - rotor, body["hub_inertia"]),
        "spring": spring,
        "spring_damping": 2 * SPRING_DAMPING * np.sqrt(rotor * spring),
        "viscous_friction": body["viscous_friction"],
        "current_decay": np.exp(-step * body["resistance"] / body["inductance"]),
    }
    parts: dict[str, list[np.ndarray]] = {}
    for j, (tip_mass, tip_inertia, carried) in enumerate(tips):
        beam = clamped_beam(
            body["length"][j], rho[j], rigidity[j], tip_mass, tip_inertia, MODES, carried,
            body["root_compliance"][j],
        )  # fmt: skip
        relative = (beam.frequency / beam.frequency[0]) ** body["rise"][j]
        ratio = body["damping_ratio"][j] + body["extra_damping"][j] * relative
        values = {k: np.asarray(getattr(beam, k)) for k in MASSES} | {
            "stiff": beam.frequency**2,
            "damp": 2 * ratio * beam.frequency,
            "outward": np.eye(MODES) - body["foreshortening"][j] * beam.foreshortening,
            "curvature": body["thickness"][j] / 2 * beam.root_curvature,
        }
        for key, value in values.items():
            parts.setdefault(key, []).append(value)
    return out | {k: np.stack(v) for k, v in parts.items()}


def unpack(state):
    """Currents, (rotor angles, hub angles, modes of each link), and the rates likewise."""
    i, x, v = state[:2], state[2 : 2 + COORDINATES], state[2 + COORDINATES :]

    def part(y):
        return y[0:2], y[2:4], (y[4 : 4 + MODES], y[4 + MODES :])

    return i, part(x), part(v)


def begin(plant, start):
    """Memory: state, bristles [1], resistances added by heat [ohm], last accelerations."""
    nothing = jnp.zeros_like(start[0])
    return tuple(start[k] for k in range(STATES)), (nothing,) * 2, (nothing,) * 2, (nothing,) * COORDINATES


def state(memory):
    """What `begin` takes."""
    return memory[0]


def encoders(p, rotor, hub):
    """What the encoders see of rotors and hubs (angles, or rates): the rotor, where it is apart."""
    return tuple(jnp.where(p["rotor"][j] > 0, rotor[j], hub[j]) for j in range(2))


def channels(plant, memory):
    """Angle, current, tip deflection, rate and strain of both joints, without any fault."""
    p, (i, (rotor, hub, q), (rotor_rate, hub_rate, _)) = plant["arm"], unpack(memory[0])
    bent = tuple(dot(p["tip"][j], q[j]) for j in range(2))
    strain = tuple(dot(p["curvature"][j], q[j]) for j in range(2))
    return encoders(p, rotor, hub), i, bent, encoders(p, rotor_rate, hub_rate), strain


def currents(plant, i, heats, rate, voltage, step):
    """Of each joint: current and heat after `step`, and the torque that a weak field takes."""
    out = []
    for j in range(2):
        law = {k: v[j] for k, v in plant["joint"].items()}
        weakening, loss, heat = winding(law, rate[j], i[j], heats[j], step)
        aim = (voltage[j] - loss - law["back_emf_constant"] * rate[j]) / law["resistance"]
        out.append((aim + plant["arm"]["current_decay"][j] * (i[j] - aim), heat, weakening))
    return tuple(zip(*out, strict=True))


def drives(plant, i, weakening, bristles, coordinates, rates, time, disturbance, step):
    """Of each joint: torque on the rotor, between rotor and hub, on the hub; the bristle after `step`."""
    p, (rotor, hub, _), (rotor_rate, hub_rate, _) = plant["arm"], coordinates, rates
    angle, rate = encoders(p, rotor, hub), encoders(p, rotor_rate, hub_rate)
    out = []
    for j in range(2):
        law = {k: v[j] for k, v in plant["joint"].items()}
        resisting, bristle = friction(law, angle[j], rate[j], i[j], bristles[j], time, step)
        on_rotor = law["torque_constant"] * i[j] + weakening[j] + resisting
        on_rotor -= p["viscous_friction"][j] * rate[j]
        lag, lag_rate = rotor[j] - hub[j], rotor_rate[j] - hub_rate[j]
        through = p["spring"][j] * lag + p["spring_damping"][j] * lag_rate + contact(law, lag, lag_rate)
        through = jnp.where(p["rotor"][j] > 0, through, on_rotor)
        on_hub = disturbance[j] - law["cable"] * (hub[j] - law["cable_rest"]) - law["load"]
        out.append((on_rotor, through, on_hub, bristle))
    return tuple(zip(*out, strict=True))


def outward(p, j, q):
    """Force on the modes of a link that turns at 1 rad/s; times `q`, the inertia [kg m^2] that bending adds."""
    return tuple(dot(p["outward"][j, k], q) for k in range(MODES))


def bend(plant, j, q, q_rate, spin):
    """Generalised force on the modes of a link that its own state exerts [N kg^-0.5]."""
    p = plant["arm"]
    harden = -plant["joint"]["hardening"][j] * dot(p["tip"][j], q) ** 3
    thrown = outward(p, j, q)
    return tuple(
        spin * spin * thrown[k] - p["stiff"][j, k] * q[k] - p["damp"][j, k] * q_rate[k]
        + p["tip"][j, k] * harden
        for k in range(MODES)
    )  # fmt: skip


def constants(p, j, q):
    """Of a bent link: b.q, c.q's own inertia less that of its modes, and the lever l = S - b.c."""
    c, b = p["coupling"][j], p["weight"][j]
    effective = p["inertia"][j] + p["hub"][j] + dot(outward(p, j, q), q) - dot(c, c)
    return dot(b, q), effective


def answer(plant, coordinates, rates, torque):
    """Link 2 held at its root: `F = L A + l` in its own frame, and what gives its own accelerations."""
    p, (_, _, (_, q)), (_, hub_rate, (q1_rate, q_rate)) = plant["arm"], coordinates, rates
    spin = hub_rate[0] + hub_rate[1] + dot(p["tip_slope"][0], q1_rate)
    c, b, m, s = p["coupling"][1], p["weight"][1], p["mass"][1], p["first_moment"][1]
    w, inertia = constants(p, 1, q)
    lever = s - dot(b, c)
    own = bend(plant, 1, q, q_rate, spin)
    turning = torque - 2 * spin * dot(outward(p, 1, q), q_rate) - dot(c, own)
    matrix = (m - w * w / inertia, w * lever / inertia, m - dot(b, b) - lever * lever / inertia)
    along = -2 * spin * dot(b, q_rate) - spin * spin * s - w * turning / inertia
    across = dot(b, own) - spin * spin * w + lever * turning / inertia
    return matrix, (along, across), own, turning


def accelerations(plant, coordinates, rates, torques, push):
    """Of all coordinates [rad/s^2, m kg^0.5/s^2], and of the rotors."""
    p, (_, hub, (q, q2)), (_, hub_rate, (q_rate, _)) = plant["arm"], coordinates, rates
    on_rotor, through, on_hub = torques
    (xx, xy, yy), (along, across), own2, turning2 = push
    spin, heading = hub_rate[0], hub[0]
    turn = hub[1] + dot(p["tip_slope"][0], q)
    cos, sin = jnp.cos(turn), jnp.sin(turn)
    # to the frame of link 1
    l_xx = cos * cos * xx - 2 * cos * sin * xy + sin * sin * yy
    l_yy = sin * sin * xx + 2 * cos * sin * xy + cos * cos * yy
    l_xy = cos * sin * (xx - yy) + (cos * cos - sin * sin) * xy
    l_x, l_y = cos * along - sin * across, sin * along + cos * across

    c, b, tip, slope = p["coupling"][0], p["weight"][0], p["tip"][0], p["tip_slope"][0]
    length = p["length"][0]
    bq, inertia = constants(p, 0, q)
    deflection, deflection_rate = dot(tip, q), dot(tip, q_rate)
    up_x = p["gravity_field"] * jnp.sin(heading + p["gravity_direction"])
    up_y = p["gravity_field"] * jnp.cos(heading + p["gravity_direction"])
    back = on_rotor[1] + on_hub[1]  # joint 2 turns link 1 back
    own = bend(plant, 0, q, q_rate, spin)
    held = tuple(own[k] - b[k] * up_y - slope[k] * back for k in range(MODES))
    turning = through[0] + on_hub[0] - back + bq * up_x - p["first_moment"][0] * up_y
    turning = turning - 2 * spin * dot(outward(p, 0, q), q_rate) - dot(c, held)
    lever = length - dot(c, tip)
    # A = a - G F and F = L A + l
    a_x = up_x - 2 * spin * deflection_rate - spin * spin * length - deflection * turning / inertia
    a_y = up_y - spin * spin * deflection + lever * turning / inertia + dot(tip, held)
    g_xx, g_xy = deflection * deflection / inertia, -deflection * lever / inertia
    g_yy = lever * lever / inertia + dot(tip, tip)
    r_x, r_y = a_x - g_xx * l_x - g_xy * l_y, a_y - g_xy * l_x - g_yy * l_y
    h_xx, h_xy = 1 + g_xx * l_xx + g_xy * l_xy, g_xx * l_xy + g_xy * l_yy
    h_yx, h_yy = g_xy * l_xx + g_yy * l_xy, 1 + g_xy * l_xy + g_yy * l_yy
    determinant = h_xx * h_yy - h_xy * h_yx
    a_x, a_y = (h_yy * r_x - h_xy * r_y) / determinant, (h_xx * r_y - h_yx * r_x) / determinant
    f_x, f_y = l_xx * a_x + l_xy * a_y + l_x, l_xy * a_x + l_yy * a_y + l_y
    first = (turning + deflection * f_x - lever * f_y) / inertia
    modes1 = tuple(held[k] - c[k] * first - tip[k] * f_y for k in range(MODES))
    # outwards to link 2
    root_x, root_y = cos * a_x + sin * a_y, cos * a_y - sin * a_x
    c2, b2 = p["coupling"][1], p["weight"][1]
    w2, inertia2 = constants(p, 1, q2)
    lever2 = p["first_moment"][1] - dot(b2, c2)
    second = (turning2 + w2 * root_x - lever2 * root_y) / inertia2
    modes2 = tuple(own2[k] - b2[k] * root_y - c2[k] * second for k in range(MODES))
    carrier = (0.0, first + dot(slope, modes1))
    hubs = (first, second - carrier[1])
    rotors = tuple(
        jnp.where(
            p["rotor"][j] > 0,
            (on_rotor[j] - through[j]) / jnp.where(p["rotor"][j] > 0, p["rotor"][j], 1.0) - carrier[j],
            hubs[j],
        )
        for j in range(2)
    )
    return (*rotors, *hubs, *modes1, *modes2)


def advance(plant, memory, time, voltage, disturbance, step, flag):
    """One step of `step` [s]."""
    state, bristles, heats, last = memory
    x, v = state[2 : 2 + COORDINATES], state[2 + COORDINATES :]
    middle = tuple(a + step / 2 * b for a, b in zip(x, v, strict=True))
    expected = tuple(a + step / 2 * b for a, b in zip(v, last, strict=True))
    i, coordinates, rates = unpack((*state[:2], *middle, *expected))
    rate = encoders(plant["arm"], rates[0], rates[1])
    after, heats, weakening = currents(plant, i, heats, rate, voltage, step)
    mean = tuple((a + b) / 2 for a, b in zip(i, after, strict=True))
    on_rotor, through, on_hub, bristles = settled(
        partial(drives, step=step),
        flag,
        plant,
        mean,
        weakening,
        bristles,
        coordinates,
        rates,
        time,
        disturbance,
    )
    push = settled(answer, flag, plant, coordinates, rates, through[1] + on_hub[1])
    pull = settled(accelerations, flag, plant, coordinates, rates, (on_rotor, through, on_hub), push)
    new_v = tuple(a + step * b for a, b in zip(v, pull, strict=True))
    new_x = tuple(a + step / 2 * b for a, b in zip(middle, new_v, strict=True))
    return (*after, *new_x, *new_v), bristles, heats, pull


def translation(home: Mapping[str, np.ndarray], guest: Mapping[str, np.ndarray]) -> np.ndarray:
    """State of the body `guest` -> state of `home`, which has rigid connections: the hubs follow the rotors."""
    loose = (guest["joint_compliance"] > 0) | (guest["backlash"] > 0)
    out = np.eye(STATES)
    for first in (2, 2 + COORDINATES):
        for j in np.flatnonzero(loose):
            out[first + 2 + j] = out[first + j]
    return out


def free_states(small: float) -> tuple[np.ndarray, np.ndarray]:
    """The states that rigid connections leave free, and a small move along each [moves, states]."""
    rotors = (2, 3, 2 + COORDINATES, 3 + COORDINATES)
    used = np.setdiff1d(np.arange(STATES), rotors)
    sizes = np.repeat([100 * small, small, 10 * small], [2, COORDINATES, COORDINATES])
    return used, np.diag(sizes)[used]
