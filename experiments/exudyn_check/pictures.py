"""The pictures of the check."""

import numpy as np
from matplotlib.figure import Figure

from experiments.pictures import figure as new_figure

from .compare import Pair
from .large import EXUDYN, PLAIN, STIFF, Spin

COLOURS = {EXUDYN: "0.55", PLAIN: "#c44e52", STIFF: "#2a6f97"}


def plot_small(pairs: dict[str, Pair]) -> Figure:
    """The tip's deflection of the last link and its path in both programs."""
    figure, axes = new_figure(len(pairs), 2, 2.6, 9.0)
    for row, (name, pair) in zip(axes, pairs.items(), strict=True):
        theirs, ours = pair.exudyn, pair.jaxflex
        for i in range(theirs.deflection.shape[1]):
            row[0].plot(theirs.times, 1e3 * theirs.deflection[:, i], color=f"C{i}", linewidth=2.5, alpha=0.45,
                        label=f"link {i + 1}, Exudyn")  # fmt: skip
            row[0].plot(ours.times, 1e3 * ours.deflection[:, i], "k--", linewidth=0.8,
                        label="jaxflex" if i == 0 else None)  # fmt: skip
        row[0].set_ylabel("tip deflection [mm]")
        row[0].set_title(name, fontsize=10)
        for j, axis_name in enumerate("xy"):
            row[1].plot(theirs.times, theirs.tip[:, j], color=f"C{j + 2}", linewidth=2.5, alpha=0.45,
                        label=f"{axis_name}, Exudyn")  # fmt: skip
            row[1].plot(ours.times, ours.tip[:, j], "k--", linewidth=0.8, label="jaxflex" if j == 0 else None)
        row[1].set_ylabel("tip position [m]")
        row[1].set_title(f"tips apart by at most {100 * pair.tip_error():.2g} % of the span", fontsize=10)
        for axis in row:
            axis.legend(fontsize=7, frameon=False, loc="best")
    for axis in axes[-1]:
        axis.set_xlabel("time [s]")
    return figure


def plot_validity(
    shaken: list[dict[str, Pair]], pushed: list[dict[str, Pair]], spins: list[Spin], bound: float
) -> Figure:
    """Error of the tip against deflection, and frequency against hub speed."""
    figure, (axes,) = new_figure(1, 2, 4, 10.0)
    for name in (PLAIN, STIFF):
        for cases, mark, what in ((shaken, "o-", "one link, shaken"), (pushed, "s--", "two links, pushed")):
            share = [100 * case[name].deflection_share() for case in cases]
            error = [100 * case[name].tip_error(1.0) for case in cases]
            reach = 0.5 if cases is shaken else 1.0
            axes[0].loglog(share, np.array(error) / reach, mark, color=COLOURS[name], markersize=4, linewidth=1.2,
                           label=f"{what}: {name}")  # fmt: skip
    axes[0].axhline(1.0, color="0.5", linewidth=0.8)
    axes[0].axvline(100 * bound, color="0.5", linewidth=0.8, linestyle=":")
    axes[0].annotate("a tenth of the length", (100 * bound, 2e-3), xytext=(4, 0),
                     textcoords="offset points", fontsize=8, color="0.35", rotation=90)  # fmt: skip
    axes[0].set_xticks([1, 2, 5, 10, 20, 40])
    axes[0].xaxis.set_minor_formatter("")
    axes[0].set_xlabel("largest tip deflection, share of the link's length [%]")
    axes[0].set_ylabel("tip error, share of the arm's length [%]")
    axes[0].set_ylim(3e-5, 1e3)
    axes[0].legend(fontsize=7.5, frameon=False, loc="upper left")
    for axis in (axes[0].xaxis, axes[0].yaxis):
        axis.set_major_formatter("{x:g}")
    ratios = [spin.ratio for spin in spins]
    for name, style, size in ((EXUDYN, "o-", 8), (PLAIN, "o-", 4), (STIFF, "o--", 3)):
        values = [spin.frequency[name] for spin in spins]
        axes[1].plot(ratios, values, style, color=COLOURS[name], markersize=size, linewidth=1.2, label=name)
    axes[1].axvline(1.0, color="0.5", linewidth=0.8, linestyle=":")
    axes[1].annotate("beyond: diverges without stiffening", (1.0, 0.12), xytext=(4, 0),
                     textcoords="offset points", fontsize=8, color="0.35")  # fmt: skip
    axes[1].set_ylim(0.0, 1.4)
    axes[1].set_xlabel("hub speed over first angular frequency at rest [1]")
    axes[1].set_ylabel("first frequency over that at rest [1]")
    axes[1].legend(fontsize=8, frameon=False, loc="center right")
    return figure


def plot_spin(spins: list[Spin], shown) -> Figure:
    """Deflection of a link while it is spun up and after it is tapped."""
    chosen = [min(spins, key=lambda s, r=r: abs(s.ratio - r)) for r in shown]
    figure, axes = new_figure(1, len(chosen), 3.4, 10.0)
    for axis, spin in zip(axes[0], chosen, strict=True):
        top = 130 * np.max(np.abs(spin.traces[EXUDYN]))
        for name, width in ((EXUDYN, 3.0), (PLAIN, 1.0), (STIFF, 1.2)):
            style = "--" if name == STIFF else "-"
            axis.plot(spin.times, 100 * spin.traces[name], style, color=COLOURS[name], linewidth=width,
                      alpha=0.4 if name == EXUDYN else 1.0, label=name)  # fmt: skip
        axis.set_ylim(-top, top)
        axis.set_title(f"hub at {spin.ratio:g} of the first frequency", fontsize=10)
        axis.set_xlabel("time [s]")
        if not np.all(np.isfinite(spin.traces[PLAIN])):
            axis.annotate("jaxflex without stiffening: diverges", (0.04, 0.94), xycoords="axes fraction",
                          fontsize=8, color=COLOURS[PLAIN])  # fmt: skip
    axes[0, 0].set_ylabel("tip deflection, share of the length [%]")
    axes[0, 0].legend(fontsize=7, frameon=False, loc="lower right")
    return figure
