"""The laws of a driven joint, whatever hangs on it: friction, cogging, winding, play.

Every value may be an array over lanes. `p` holds the parameters of one joint by the names of
LAWS, and the motor's constants; zero means absent (for a scale: no matter).
"""

import jax.numpy as jnp

LAWS = dict(
    # friction at the rotor: a level times a bristle, which bends over `presliding` rad and then slides
    dry=0.0, asymmetry=0.0, stribeck=0.0, stribeck_rate=0.2, presliding=5e-4,
    growth=0.0, patch=0.0, patch_angle=0.0, patch_width=0.1, load_friction=0.0,
    drag=0.0, ripple=0.0, ripple_order=8.0, ripple_phase=0.0,
    cable=0.0, cable_rest=0.0, load=0.0, hardening=0.0,
    backlash=0.0, contact=0.0, contact_damping=0.0,
    magnetic=0.0, warming=0.0, cooling=0.1,
    delay=0.0, limit=1e9, dead_zone=0.0,
)  # fmt: skip
MICRO_DAMPING = 1e-3  # s: damping of the bristle while it bends, by its stiffness


def friction(p, angle, rate, current, bristle, time, step):
    """Torque [N m] of everything that resists the rotor's motion, and the bristle after `step`.

    The torque is that halfway, where `angle`, `rate` and `current` are, the `bristle` that before the
    step; it bends as it does exactly at a constant rate.
    """
    stays = jnp.exp(-step * jnp.abs(rate) / p["presliding"])
    bend = stays * bristle + (1 - stays) * jnp.sign(rate)
    halfway = (bristle + bend) / 2
    level = p["dry"] * (1 + p["asymmetry"] * halfway) + p["growth"] * time
    level += p["stribeck"] / (1 + (rate / p["stribeck_rate"]) ** 2)
    level += p["patch"] / (1 + ((angle - p["patch_angle"]) / p["patch_width"]) ** 4)
    level += p["load_friction"] * jnp.abs(p["torque_constant"] * current)
    torque = -level * (halfway + MICRO_DAMPING * (bend - bristle) / step) - p["drag"] * rate * jnp.abs(rate)
    return torque - p["ripple"] * jnp.sin(p["ripple_order"] * angle + p["ripple_phase"]), bend


def winding(p, rate, current, heat, step):
    """What saturation and heat change: torque [N m], voltage lost [V], added resistance [ohm] after `step`.

    The field weakens with the current, `K / (1 + a i^2)`; the resistance rises with the
    copper loss and falls back.
    """
    weak = 1 / (1 + p["magnetic"] * current * current) - 1
    loss = heat * current + weak * p["back_emf_constant"] * rate
    heat = heat + step * (p["warming"] * p["resistance"] * current * current - p["cooling"] * heat)
    return weak * p["torque_constant"] * current, loss, heat


def amplifier(p, voltage):
    """The voltage [V] that a saturating amplifier with a dead zone makes of a command."""
    voltage = jnp.clip(voltage, -p["limit"], p["limit"])
    return voltage - jnp.clip(voltage, -p["dead_zone"], p["dead_zone"])


def contact(p, lag, lag_rate):
    """Torque [N m] that a rotor ahead by `lag` [rad] gives to the hub across the play."""
    press = lag - jnp.clip(lag, -p["backlash"], p["backlash"])
    return p["contact"] * press + jnp.where(press != 0, p["contact_damping"] * lag_rate, 0.0)
