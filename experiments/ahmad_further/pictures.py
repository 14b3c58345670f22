"""The picture: deflection of the first link for every arm and design."""

import numpy as np
from matplotlib.figure import Figure

LENGTH = 0.5  # m, of every link
COLOURS = {"textbook PD": "#c44e52", "textbook PD, ZVD": "#dd8452", "tuned": "#2a6f97"}


def plot_moves(cases, payload: int) -> Figure:
    """Distance of the tip from its target, and deflection of the first link, with the middle payload."""
    figure = Figure(figsize=(11.0, 5.4), layout="constrained")
    axes = figure.subplots(2, len(cases), squeeze=False)
    for column, (title, case) in enumerate(cases.items()):
        trajectory = case.trajectory
        for i, (name, design) in enumerate(case.designs.items()):
            times = np.asarray(trajectory.times[i, payload])
            tip = np.stack([np.asarray(trajectory[f"tip_{axis}"][i, payload]) for axis in "xy"], axis=1)
            angles = np.cumsum([float(a) for a in design.move.stop])
            target = LENGTH * np.array([np.cos(angles).sum(), np.sin(angles).sum()])
            away = np.linalg.norm(tip - target, axis=1)
            axes[0, column].semilogy(times, 1e3 * away, color=COLOURS[name], linewidth=1.2, label=name)
            bend = np.asarray(trajectory["tip_deflection_1"][i, payload])
            axes[1, column].plot(times, 1e3 * bend, color=COLOURS[name], linewidth=1.2)
        end = float(design.move_time())
        for axis in axes[:, column]:
            axis.axvline(end, color="0.4", linestyle=":", linewidth=1)
            axis.annotate("end of move", (end, 1.0), xycoords=("data", "axes fraction"), xytext=(3, -9),
                          textcoords="offset points", fontsize=7, color="0.3")  # fmt: skip
            axis.grid(True, alpha=0.3, linewidth=0.5)
            axis.spines[["top", "right"]].set_visible(False)
        axes[0, column].set_title(title, fontsize=10)
        axes[1, column].set_xlabel("time [s]")
    axes[0, 0].set_ylabel("tip from its target [mm]")
    axes[1, 0].set_ylabel("tip deflection, link 1 [mm]")
    axes[0, 0].legend(fontsize=8, frameon=False, loc="lower left")
    return figure
