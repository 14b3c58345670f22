"""The arm in motion: a GIF, an MP4, or a player in a notebook, deflection exaggerated to taste."""

from pathlib import Path
from shutil import which

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from matplotlib.animation import FFMpegWriter, FuncAnimation, PillowWriter
from matplotlib.figure import Figure

from .arm.arm import Arm, AssembledArm
from .arm.kinematics import poses
from .arm.parts import Link
from .scalars import Scalar, scalar
from .simulation.trajectory import Trajectory

_POINTS = 24
_TAIL = 0.6
"""Time [s] of the tip's path that is drawn behind it."""


class Animation(FuncAnimation):
    """A matplotlib animation that notebooks show as a player."""

    def _repr_html_(self) -> str:
        return self.to_jshtml(default_mode="loop")


def animate(
    arm: Arm,
    run: Trajectory,
    path: str | Path | None = None,
    *,
    exaggeration: float = 1.0,
    speed: float = 1.0,
    frames_per_second: int = 25,
) -> Animation:
    """`run` of `arm` as an animation, written to `path` (`.gif`, or `.mp4` where ffmpeg is there).

    Deflections and slopes are drawn `exaggeration` times as large, the angles of the joints as
    they are; the dashed arm has the same angles and straight links. `speed` 0.5 is half of real
    time. Returned is matplotlib's animation, which shows itself in a notebook.

    **Raises** `ValueError` for a batch, a trajectory without states, an arm without links, or
    an ending of `path` that is not among those above.
    """
    if run.state is None or np.ndim(run.status) or not arm.links:
        raise ValueError(
            "animate needs one run as simulate returns it, of an arm with links; of a batch, index one member: "
            "jax.tree.map(lambda x: x[0], runs)."
        )
    if not (exaggeration >= 0 and speed > 0 and frames_per_second > 0):
        raise ValueError(
            "animate: exaggeration of at least 0, speed and frames_per_second above 0 are allowed."
        )
    writer = None if path is None else _writer(path, frames_per_second)
    q = jnp.stack([jnp.broadcast_to(c, run.times.shape) for c in run.state.q], axis=-1)
    start, stop = float(run.times[0]), float(run.times[-1])
    count = max(2, round((stop - start) / speed * frames_per_second) + 1)
    times = np.linspace(start, stop, count)
    q = jax.vmap(lambda c: jnp.interp(times, run.times, c), 1, 1)(q)
    bent = np.asarray(_shapes(arm, q, scalar(exaggeration)))
    straight = np.asarray(_shapes(arm, q, scalar(0.0)))
    moving = _animation(arm, times, bent, straight, exaggeration, 1000 / frames_per_second)
    if path is not None and writer is not None:
        moving.save(path, writer=writer, dpi=100)
    return moving


def _writer(path: str | Path, frames_per_second: int):
    kind = Path(path).suffix.lower()
    if kind == ".gif":
        return PillowWriter(fps=frames_per_second)
    if kind != ".mp4":
        raise ValueError(f"{path}: an animation ends in .gif, or in .mp4 where ffmpeg is installed.")
    if which("ffmpeg") is None:
        raise ValueError(f"{path}: .mp4 needs ffmpeg, which is not installed; write a .gif.")
    return FFMpegWriter(fps=frames_per_second, bitrate=1800)


@eqx.filter_jit
def _shapes(
    arm: Arm, q: Float[Array, "frames size"], exaggeration: Scalar
) -> Float[Array, "frames links points 2"]:
    """Points [m] along every link in the base frame, its deflection times `exaggeration`."""
    model = arm.assemble()
    joints = len(model.links)
    along = jnp.linspace(0.0, 1.0, _POINTS)
    shapes = [_deflections(model, i, along) for i in range(len(arm.links))]

    def draw(q):
        q = jnp.concatenate([q[:joints], exaggeration * q[joints:]])
        frames, _ = poses(model, tuple(q))
        lines = []
        for frame, shape, link, eta in zip(
            frames, shapes, model.arm.links, model.split(tuple(q))[1], strict=False
        ):
            w = shape @ jnp.stack(eta) if eta else jnp.zeros(_POINTS)
            x, c, s = along * link.length, jnp.cos(frame.heading), jnp.sin(frame.heading)
            lines.append(jnp.stack([frame.x + c * x - s * w, frame.y + s * x + c * w], axis=-1))
        return jnp.stack(lines)

    return jax.vmap(draw)(q)


def _deflections(
    model: AssembledArm, i: int, along: Float[Array, " points"]
) -> Float[Array, "points shapes"]:
    """The deflection shapes of link `i` at `along` of its length.

    Of an assumed-modes link its own; of any other the cubic with the same tip.
    """
    link, constants, joint = model.arm.links[i], model.links[i], model.joints[i]
    if link.modes == 0:
        return (
            along[:, None] * jnp.stack(constants.tip_deflection)
            if constants.loose
            else jnp.zeros((_POINTS, 0))
        )
    tip, slope = jnp.stack(constants.tip_deflection), link.length * jnp.stack(constants.tip_slope)
    if not isinstance(link, Link) or link.model == "lumped":
        u = along[:, None]
        return (3 * u**2 - 2 * u**3) * tip + (u**3 - u**2) * slope
    basis = link.basis(model.arm.distal(i), i + 1 < len(model.arm.links), joint.compliance)
    found = jax.vmap(basis.deflection)(along * scalar(link.length))
    return jnp.column_stack([found, along * link.length]) if constants.loose else found


def _animation(
    arm: Arm, times: np.ndarray, bent: np.ndarray, straight: np.ndarray, exaggeration: float, interval: float
) -> Animation:
    low, high = bent.reshape(-1, 2).min(axis=0), bent.reshape(-1, 2).max(axis=0)
    margin = 0.08 * max(high - low)
    size = 4.8 * np.clip((high - low + 2 * margin) / max(high - low + 2 * margin), 0.45, 1.0)
    figure = Figure(figsize=(size[0] + 1.4, size[1] + 0.9), layout="constrained")
    axis = figure.subplots()
    axis.set(xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin))
    axis.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
    axis.grid(True, alpha=0.25, linewidth=0.5)
    axis.spines[["top", "right"]].set_visible(False)
    (rigid,) = axis.plot([], [], "--", color="0.6", linewidth=1)
    (trail,) = axis.plot([], [], color="#c44e52", linewidth=1, alpha=0.7)
    lines = [axis.plot([], [], color="#2a6f97", linewidth=3, solid_capstyle="round")[0] for _ in arm.links]
    (joints,) = axis.plot([], [], "o", color="0.15", markersize=8)
    (payload,) = axis.plot([], [], "s", color="#c44e52", markersize=8)
    tail = max(1, int(_TAIL / (times[1] - times[0])))

    def frame(k: int):
        for line, points in zip(lines, bent[k], strict=True):
            line.set_data(points[:, 0], points[:, 1])
        rigid.set_data(straight[k].reshape(-1, 2).T)
        roots, tip = bent[k, :, 0], bent[k, -1, -1]
        joints.set_data(roots[:, 0], roots[:, 1])
        payload.set_data([tip[0]], [tip[1]])
        path = bent[max(0, k - tail) : k + 1, -1, -1]
        trail.set_data(path[:, 0], path[:, 1])
        drawn = "" if exaggeration == 1 else f", deflection × {exaggeration:g}"
        axis.set_title(f"{times[k]:.2f} s{drawn}", fontsize=10, loc="left")
        return [*lines, rigid, joints, payload, trail]

    frame(0)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # the layout of the first frame serves all, at a tenth of the time
    return Animation(figure, frame, frames=len(times), interval=interval)
