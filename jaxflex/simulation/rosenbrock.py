"""Steps that treat elastic links, windings and what holds a joint implicitly, all else explicitly.

The fastest rates of an arm are those of its highest modes and windings. They are no part of
the motion that is wanted, but hold an explicit method to steps of a fraction of their
period. Their stiffness is known, though: K and D of the links are constants, and so is R/L.
A W-method (Steihaug and Wolfbrandt 1979) is a Rosenbrock method that keeps its order
whatever matrix stands in for the Jacobian. With

    J = [[0, 1], [-M^-1 K, -M^-1 D]] for the arm, -R/L for the windings, -|rate|/s for bristles

of dry friction, K and D with the slopes of drives, controller and friction at each joint on their diagonal,
a stage costs one right-hand side and one more solve of the size of M. The coefficients are
those of ROS34PW2 (Rang and Angermann 2005): four stages, order 3, stiffly accurate.
"""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import jax.tree_util as jtu
import numpy as np

from ..arm.arm import AssembledArm
from ..drive import effect_torques, has_current_state, joint_effects
from ..dynamics.lagrange import inertia
from ..dynamics.ldl import factorised, substitute
from ..effects import AbstractDryFriction
from ..scalars import Scalar, dot
from .plant import Plant, State, derivative, within

_GAMMA = 0.435866521508459
_ALPHA = np.array(
    [
        [0, 0, 0, 0],
        [0.8717330430169180, 0, 0, 0],
        [0.8445706001536942, -0.1129906423648419, 0, 0],
        [0, 0, 1, 0],
    ]
)
_COUPLING = np.array(
    [
        [_GAMMA, 0, 0, 0],
        [-0.8717330430169180, _GAMMA, 0, 0],
        [-0.9033805701304408, 0.0541806723880953, _GAMMA, 0],
        [0.2421238070609535, -1.2232505839045147, 0.5452602553351021, _GAMMA],
    ]
)
_WEIGHTS = np.array([0.2421238070609535, -1.2232505839045147, 1.545260255335102, _GAMMA])
# in the unknowns u = Gamma k / h, which spare the products with J (Hairer and Wanner 1996, IV.7)
# and are finite where h is zero
_A = _ALPHA @ np.linalg.inv(_COUPLING)
_C = np.eye(4) / _GAMMA - np.linalg.inv(_COUPLING)
_M = _WEIGHTS @ np.linalg.inv(_COUPLING)
_TIMES = _ALPHA.sum(axis=1)


class LinearlyImplicit(eqx.Module):
    """For `Fixed(dt, LinearlyImplicit())`: links and windings implicit, order 3; see this module.

    Right where steps are held short by stability and not by accuracy, that is for smooth
    motion of arms with several modes. Fast modes that a jolt does excite are damped.
    """


def rosenbrock_step(plant: Plant, t: Scalar, h: Scalar, seen: tuple, state: State) -> State:
    """One step of `h` [s] from `t`, of whose input only what is within `seen` is read."""
    model = plant.model
    mass = inertia(model, state.q)
    held_by, slowed_by = _joint_slopes(plant, t, state)
    stiffness = tuple(k + c for k, c in zip(model.stiffness(), held_by, strict=True))
    damping = tuple(d + c for d, c in zip(model.damping(), slowed_by, strict=True))
    g = h * _GAMMA
    # M + g D + g^2 K
    shifted = [
        [value + (g * (damping[i] + g * stiffness[i]) if i == j else 0.0) for j, value in enumerate(row)]
        for i, row in enumerate(mass)
    ]
    # its inverse, once a step: rows times a vector are independent of one another, which XLA fuses
    # without computing anything twice, a substitution is not
    factor = factorised(shifted)
    one = jnp.ones_like(t)
    inverse = [
        substitute(*factor, tuple(one * (i == j) for j in range(model.size))) for i in range(model.size)
    ]
    settling = _settling(model, state)
    decays = tuple(
        joint.motor.resistance / joint.motor.inductance  # pyright: ignore
        for i, joint in enumerate(model.joints)
        if has_current_state(model, i)
    )

    def solved(r: State) -> State:
        """`u` with `(1 / gamma - h J) u = r`."""
        # M r = (shifted - g D - g^2 K) r, so M itself is not needed
        pull = tuple(
            (d + g * k) * v + k * x for d, k, x, v in zip(damping, stiffness, r.q, r.qd, strict=True)
        )
        rates = tuple(_GAMMA * (v - g * dot(row, pull)) for v, row in zip(r.qd, inverse, strict=True))
        moved = tuple(_GAMMA * (x + h * v) for x, v in zip(r.q, rates, strict=True))
        rest = jtu.tree_map(lambda x: _GAMMA * x, r)
        bent = jtu.tree_map(lambda x, d: x / (1 / _GAMMA + h * d), r.joint, settling)
        current = r.current and tuple(
            x / (1 / _GAMMA + h * d) for x, d in zip(r.current, decays, strict=True)
        )
        return rest._replace(q=moved, qd=rates, current=current, joint=bent)

    def combined(base: State, weights, stages: tuple[State, ...]) -> State:
        def add(x, *parts):
            return x + sum(w * p for w, p in zip(weights, parts, strict=True))

        return jtu.tree_map(add, base, *stages)

    def stage(stages, given):
        # a scan, so that one program serves the four stages
        number, ahead, a, c = given
        now = t + ahead * h
        slope = derivative(within(seen, now), combined(state, tuple(a * h), stages), plant)
        found = solved(combined(slope, tuple(c), stages))
        return tuple(
            jtu.tree_map(partial(jnp.where, number == i), found, old) for i, old in enumerate(stages)
        ), None

    none = (jtu.tree_map(jnp.zeros_like, state),) * 4
    given = (jnp.arange(4), jnp.asarray(_TIMES), jnp.asarray(_A), jnp.asarray(_C))
    stages, _ = jax.lax.scan(stage, none, given)
    return combined(state, tuple(_M * h), stages)


def _settling(model: AssembledArm, state: State) -> tuple | None:
    """How fast what the joint effects remember settles [1/s], as `state.joint`."""
    rates, _ = model.split(state.qd)
    return state.joint and tuple(
        effect.settling(rates[effect.index])
        if isinstance(effect, AbstractDryFriction) and kept is not None
        else None
        for effect, kept in zip(joint_effects(model), state.joint, strict=True)
    )


def _joint_slopes(plant: Plant, t: Scalar, state: State) -> tuple[tuple, tuple]:
    """How drives, controller and friction hold each joint, `-d torque / d angle`, and slow it, `- / d rate`."""
    joints = len(plant.model.joints)

    def torque(i, angle, rate):
        q = (*state.q[:i], angle, *state.q[i + 1 :])
        qd = (*state.qd[:i], rate, *state.qd[i + 1 :])
        felt = effect_torques(joint_effects(plant.model), q[:joints], qd[:joints], t, state.joint)[i]
        return -plant.drives(t, state._replace(q=q, qd=qd)).torque[i] - felt

    pairs = [jax.grad(torque, (1, 2))(i, state.q[i], state.qd[i]) for i in range(joints)]
    none = (jnp.zeros_like(t),) * (plant.model.size - joints)
    held_by, slowed_by = zip(*pairs, strict=True)
    return held_by + none, slowed_by + none
