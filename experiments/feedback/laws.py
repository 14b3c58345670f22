"""The laws compared, for Foldager's link, and the drive they run on."""

import jax.numpy as jnp
import numpy as np

import controllers as ctl
import jaxflex as jf

PERIOD = 5e-4  # s
COUNT = 2 * np.pi / 40_000  # rad, an encoder of 10 000 lines
GAUGE = 5e-4  # 1/m, one count of the strain gauge
SMOOTHING = 1e-3  # s, filter of the differences
HUB = 3e-3  # kg m^2: as much as the link turns, as a geared motor would bring
BANDWIDTH = 4 * np.pi  # rad/s

COST = {"angle_1": 0.01, "tip_deflection_1": 0.003}
SENSORS = {"angle_1": 1e-5, "curvature_1": 1e-3}


def link() -> jf.Arm:
    """The arm, with one mode more than the laws are designed with."""
    return jf.foldager_link(0.02, modes=2, hub_inertia=HUB)


def laws(period: float | None) -> dict[str, jf.AbstractController]:
    """Every law, in its continuous form or made for a period [s]; designed on a model of one mode."""
    model = jf.foldager_link(0.02, modes=1, hub_inertia=HUB)
    pose = jnp.array([0.8])
    pd = ctl.textbook_pd(model, pose, BANDWIDTH)
    second = float(jf.driven_frequencies(link())[2])
    damped = ctl.Sum((pd, ctl.StrainRateFeedback(0.15)))
    found: dict[str, jf.AbstractController] = {
        "PD": pd,
        "PD, notch": ctl.Filtered(pd, [ctl.notch(second, 1.0, 0.1, period)]),
        "PID": ctl.PID(pd, tuple(2.0 * k for k in pd.stiffness), (24.0,)),
        "PD, strain rate": damped,
        "PD, inverse dynamics": ctl.Sum((pd, ctl.InverseDynamics(model))),
        "PD, strain rate, inverse dynamics": ctl.Sum((damped, ctl.InverseDynamics(model))),
        "computed torque": ctl.ComputedTorque(model, (BANDWIDTH**2,), (2 * BANDWIDTH,)),
        "LQG": ctl.lqg(model, pose, COST, 5.0, SENSORS, 3.0, period),
    }
    return found


def on_a_drive(law: jf.AbstractController) -> jf.AbstractController:
    """The law as a digital drive runs it: counts, differences, commands held."""
    return ctl.ZeroOrderHold(ctl.Instrumented(law, COUNT, GAUGE, SMOOTHING), PERIOD)
