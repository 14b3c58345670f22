"""The linear part of a driven joint, and its exact step: motor winding, inertias, springs, link.

       base --[spring]-- stator )motor( rotor --[joint spring]-- hub --[root spring]-- link ~~~ payload

A spring of zero compliance is a rigid connection, which removes a coordinate. Whatever the
connections, the matrices are padded to the same size, so that all plants run in one program.
"""

from collections.abc import Mapping

import numpy as np

from .beam import clamped_beam

COORDINATES = 6
STATES = 1 + 2 * COORDINATES  # current, coordinates, their rates
ROTOR_SHARE = 0.6  # of the hub inertia, where rotor and hub come apart
SPRING_DAMPING = 0.02  # damping ratio of the connections, where they have a spring
LINK_MODES = 4


def structure(body: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Matrices of the plant with physical parameters `body` (SI; of its one joint).

    Returns

    - `system` [STATES, STATES + 1], the rate of (current, coordinates, rates) from (state, voltage)
    - rows that read from the coordinates: `motor` and `hub` (angles relative to the stator),
      `frame` (absolute angle of the hub), `deflection` and `tip` [m], `strain`, `gravity` (mass
      times height [kg m] of the arm along x), and `mode`, 1 at the coordinates of link modes
    - `first_moment` [kg m] of the straight link; `mobility`, the inverse mass matrix;
      `tension`, the stiffness that turning at 1 rad/s adds by foreshortening
    """
    p = {k: float(v[0]) for k, v in body.items()}
    loose = p["backlash"] > 0
    springs = {
        "base": p["base_compliance"],
        "rotor": p["joint_compliance"],
        "root": p["root_compliance"],
    }
    linked = p["length"] > 0
    names = [n for n in ("base", "rotor") if springs[n] > 0 or (n == "rotor" and loose)]
    names += ["hub"] + (["root"] if springs["root"] > 0 else [])
    modes = min(LINK_MODES, COORDINATES - len(names)) if linked else 0
    size = len(names) + modes

    def row(name: str) -> np.ndarray:
        """The absolute angle of a body: its own coordinate, or that of what it is rigidly tied to."""
        out = np.zeros(size)
        tied = {"base": None, "rotor": "hub", "root": "hub"}
        if name in names:
            out[names.index(name)] = 1.0
        elif tied[name] is not None:
            return row(tied[name])
        return out

    base, rotor, hub, root = (row(n) for n in ("base", "rotor", "hub", "root"))
    elastic = np.eye(size)[len(names) :]
    motor = rotor - base
    mass = p["base_inertia"] * np.outer(base, base)
    mass = mass + ROTOR_SHARE * p["hub_inertia"] * np.outer(rotor, rotor)
    mass = mass + (1 - ROTOR_SHARE) * p["hub_inertia"] * np.outer(hub, hub)
    stiff, damp = np.zeros((size, size)), p["viscous_friction"] * np.outer(motor, motor)
    out = {name: np.zeros(COORDINATES) for name in ("deflection", "tip", "strain", "gravity", "mode")}
    out["first_moment"] = np.asarray(0.0)
    tension = np.zeros((COORDINATES, COORDINATES))
    if linked:
        area = p["width"] * p["thickness"]
        beam = clamped_beam(
            p["length"],
            p["density"] * area,
            p["youngs_modulus"] * area * p["thickness"] ** 2 / 12,
            p["payload_mass"],
            p["payload_inertia"],
            modes,
        )
        ratios = p["damping_ratio"] + p["extra_damping"] * (beam.frequency / beam.frequency[0]) ** p["rise"]
        cross = np.outer(root, beam.coupling @ elastic)
        mass = mass + beam.inertia * np.outer(root, root) + cross + cross.T + elastic.T @ elastic
        stiff = stiff + elastic.T @ np.diag(beam.frequency**2) @ elastic
        damp = damp + elastic.T @ np.diag(2 * ratios * beam.frequency) @ elastic
        out["deflection"][:size] = p["length"] * (root - hub) + beam.tip @ elastic
        out["tip"][:size] = p["length"] * root + beam.tip @ elastic
        out["strain"][:size] = p["thickness"] / 2 * beam.root_curvature @ elastic
        out["gravity"][:size] = beam.first_moment * root + beam.weight @ elastic
        out["mode"][len(names) : size] = 1.0
        out["first_moment"] = np.asarray(beam.first_moment)
        tension[:size, :size] = elastic.T @ beam.foreshortening @ elastic
    for inertia, arm, compliance in (
        (p["base_inertia"], base, springs["base"]),
        (ROTOR_SHARE * p["hub_inertia"], rotor - hub, springs["rotor"]),
        (p["hub_inertia"], hub - root, springs["root"]),
    ):
        if compliance > 0:
            stiff = stiff + np.outer(arm, arm) / compliance
            damp = damp + 2 * SPRING_DAMPING * np.sqrt(inertia / compliance) * np.outer(arm, arm)

    mobility = np.linalg.inv(mass)
    system = np.zeros((STATES, STATES + 1))
    x, v = slice(1, 1 + size), slice(1 + COORDINATES, 1 + COORDINATES + size)
    system[0, 0] = -p["resistance"] / p["inductance"]
    system[0, v] = -p["back_emf_constant"] / p["inductance"] * motor
    system[0, -1] = 1 / p["inductance"]
    system[x, v] = np.eye(size)
    system[v, x], system[v, v] = -mobility @ stiff, -mobility @ damp
    system[v, 0] = p["torque_constant"] * mobility @ motor
    for name, value in (("motor", motor), ("hub", hub - base), ("frame", hub)):
        out[name] = np.pad(value, (0, COORDINATES - size))
    padded = np.zeros((COORDINATES, COORDINATES))
    padded[:size, :size] = mobility
    return out | {"system": system, "mobility": padded, "tension": tension}
