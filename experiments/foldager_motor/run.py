"""The motor alone (section 6.1, Fig. 7)."""

from pathlib import Path

import jax.numpy as jnp
import numpy as np

from ..pictures import MEASURED, OURS, figure
from .sines import measured_gains
from .steps import BANDWIDTH, cases, gains, motor_axis, poles_hz


def run(folder: Path, reduced: bool) -> dict:
    """Do angle and speed of the motor follow the paper's transfer functions and their step responses?"""
    shown = cases(26 if reduced else 251)
    draw_steps(shown).savefig(folder / "steps.png", dpi=130)

    axis, pd = motor_axis(), gains("voltage")
    tested = jnp.asarray(np.geomspace(1.0, 200.0, 4 if reduced else 16))
    s = 2j * jnp.pi * tested
    found = {"open": measured_gains(tested, False), "closed": measured_gains(tested, True)}
    exact = {"open": axis.open_loop(s), "closed": axis.closed_loop(s, pd.stiffness[0], pd.damping[0])}
    fine = jnp.asarray(np.geomspace(0.7, 280.0, 200))
    z = 2j * jnp.pi * fine
    lines = {"open": axis.open_loop(z), "closed": axis.closed_loop(z, pd.stiffness[0], pd.damping[0])}
    draw_sines(tested, found, fine, lines).savefig(folder / "sines.png", dpi=130)

    # (4) as printed leaves L b s^2 out
    motor, j, b = axis.motor, axis.inertia, axis.viscous_friction
    full = jnp.polyval(axis.denominator(), z)
    left_out = jnp.abs(motor.inductance * b * z**2 / (full - motor.inductance * b * z**2))
    speed_poles = np.roots(np.asarray(axis.denominator())[:3])
    return {
        "parameters": {
            "resistance_ohm": float(motor.resistance),
            "inductance_H": float(motor.inductance),
            "torque_constant_N_m_A": float(motor.torque_constant),
            "back_emf_constant_V_s_rad": float(motor.back_emf_constant),
            "inertia_kg_m2": float(j),
            "viscous_friction_N_m_s": float(b),
            "pd_bandwidth_rad_s": BANDWIDTH,
            "pd_stiffness_V_rad": float(pd.stiffness[0]),
            "pd_damping_V_s_rad": float(pd.damping[0]),
        },
        "step_error": {case.title: case.error() for case in shown},
        "sine_error": {
            name: float(jnp.abs(found[name] / exact[name] - 1).max()) for name in ("open", "closed")
        },
        "term_left_out_of_4_pct": 100 * float(left_out.max()),
        "final_speed_after_6_V_rad_s": float(axis.speed_after_step(6.0, jnp.asarray(10.0))),
        "open_loop_time_constants_ms": sorted((-1e3 / speed_poles).tolist()),
        "closed_loop_poles_hz": poles_hz("voltage").tolist(),
    }


def draw_steps(shown):
    """Angle and speed of the four cases, the closed form as a line and the simulation as points."""
    made, axes = figure(2, len(shown), height=2.5, width=13.0)
    for column, case in enumerate(shown):
        every = max(len(case.times) // 25, 1)
        for row, label in enumerate(("angle [rad]", "speed [rad/s]")):
            axis = axes[row, column]
            axis.plot(case.times, case.closed_form[row], color=OURS, label="closed form")
            axis.plot(
                case.times[::every], case.simulated[row][::every], "o", color=MEASURED, markersize=3,
                label="simulated",
            )  # fmt: skip
            axis.set_ylabel(label)
        axes[0, column].set_title(case.title, fontsize=10)
        axes[1, column].set_xlabel("time [s]")
    axes[0, 0].legend(fontsize=8, frameon=False)
    return made


def draw_sines(tested, found, fine, lines):
    """Gain and phase of (4) and (7), the transfer function as a line and the sine tests as points."""
    made, axes = figure(2, 2, height=2.5)
    titles = {"open": "(4): angle over voltage", "closed": "(7): angle over desired angle, PD"}
    units = {"open": "gain [rad/V]", "closed": "gain [rad/rad]"}
    for column, name in enumerate(("open", "closed")):
        gain, phase = axes[:, column]
        gain.loglog(fine, jnp.abs(lines[name]), color=OURS, label="transfer function")
        gain.loglog(tested, jnp.abs(found[name]), "o", color=MEASURED, markersize=4, label="simulated sines")
        phase.semilogx(fine, np.degrees(np.unwrap(np.angle(lines[name]))), color=OURS)
        degrees = np.degrees(np.unwrap(np.angle(found[name])))
        phase.semilogx(tested, degrees, "o", color=MEASURED, markersize=4)
        gain.set_title(titles[name], fontsize=10)
        gain.set_ylabel(units[name])
        phase.set_ylabel("phase [deg]")
        phase.set_xlabel("frequency [Hz]")
    axes[0, 0].legend(fontsize=8, frameon=False)
    return made
