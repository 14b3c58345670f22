"""The result of a simulation: named channels, how the solver fared, and whether to trust it."""

from collections.abc import Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float, Int

from ..sensors import unit
from .frames import from_dataset, from_frame, to_dataset, to_frame
from .plant import State

OK, STEPS_EXHAUSTED, STEP_TOO_SMALL, DIVERGED, INPUT_UNFIT = 0, 1, 2, 3, 4
REASONS = {
    STEPS_EXHAUSTED: "the solver ran out of steps before the last time; raise max_steps, loosen rtol, "
    "or use a stiff solver (Adaptive(solver=diffrax.Kvaerno5()))",
    STEP_TOO_SMALL: "the solver asked for steps below 1e-10 s: the motion is no longer finite, or the "
    "loop is too stiff for it; check the gains and the parameters, or use a stiff solver",
    DIVERGED: "the arm diverged: a link bent by more than its own length, or a state is no longer "
    "finite; the loop is unstable (check the signs and sizes of the gains) or the step is too large",
    INPUT_UNFIT: "the reference or a disturbance is no polynomial of time (of degree 5) between the times "
    "wanted and its jumps, which Exact() needs; ask for more times, or use Adaptive()",
}


class Trajectory(eqx.Module):
    """What `simulate` returns. Under `vmap` every array has a leading batch axis.

    **Fields**

    - `times` [s], shape `(times,)`
    - `channels`: name to array `(times,)`; `trajectory["angle_1"]` for short, and
      `trajectory.unit("angle_1")` for its unit. A member that failed holds NaN.
    - `state`: coordinates, rates, currents and controller memory at `times`; None in a
      trajectory that was made of its channels
    - `status`: 0 where the simulation succeeded, else a key of `REASONS`
    - `steps`, `rejected`: numbers of solver steps
    """

    times: Float[Array, "*batch times"]
    channels: dict[str, Float[Array, "*batch times"]]
    state: State | None
    status: Int[Array, "*batch"]
    steps: Int[Array, "*batch"]
    rejected: Int[Array, "*batch"]

    def __getitem__(self, channel: str) -> Array:
        if channel not in self.channels:
            raise KeyError(f"no channel {channel!r}; there are {', '.join(self.channels)}.")
        return self.channels[channel]

    def __repr__(self) -> str:
        if isinstance(self.status, Tracer):
            return f"Trajectory(channels={list(self.channels)}, traced)"
        failed = int(np.sum(np.asarray(self.status) != OK))
        batch = f"batch {self.status.shape}, " if self.status.ndim else ""
        count = self.times.shape[-1]
        return (
            f"Trajectory({batch}{count} times to {float(np.max(self.times)):g} s, "
            f"{int(np.max(self.steps))} steps, {failed} failed; {', '.join(self.channels)})"
        )

    def unit(self, channel: str) -> str:
        """Unit of a channel."""
        return unit(channel)

    @property
    def tip(self) -> Float[Array, "*batch times 2"]:
        """Position of the payload [m] in the base frame, x and y last."""
        return jnp.stack([self["tip_x"], self["tip_y"]], axis=-1)

    def to_pandas(self) -> Any:
        """A `pandas.DataFrame` of the channels by `time` [s], and by `member` under `vmap`; extra `frames`."""
        return to_frame(self.times, self.channels)

    def to_xarray(self) -> Any:
        """An `xarray.Dataset` of the channels over `time` [s] with their units; extra `frames`."""
        return to_dataset(self.times, self.channels)

    @classmethod
    def from_pandas(cls, frame: Any) -> "Trajectory":
        """The trajectory in a DataFrame that `to_pandas` made, or one like it; raises `ValueError`."""
        return cls.from_channels(*from_frame(frame))

    @classmethod
    def from_xarray(cls, dataset: Any) -> "Trajectory":
        """The trajectory in a Dataset that `to_xarray` made, or one like it; raises `ValueError`."""
        return cls.from_channels(*from_dataset(dataset))

    @classmethod
    def from_channels(cls, times: Any, channels: Mapping[str, Any]) -> "Trajectory":
        """A trajectory of given `times` [s] and `channels`, each `(*batch, times)`, without states.

        A member that holds NaN counts as failed.
        """
        times = jnp.asarray(times)
        given = {name: jnp.asarray(values) for name, values in channels.items()}
        whole = jnp.ones(times.shape[:-1], bool)
        for values in given.values():
            whole = whole & jnp.isfinite(values).all(axis=-1)
        none = jnp.zeros(times.shape[:-1], int)
        return cls(times, given, None, jnp.where(whole, OK, DIVERGED), none, none)

    def check(self) -> "Trajectory":
        """The trajectory itself if every member succeeded.

        **Raises** `SimulationError` naming each member that failed and why; the error
        keeps the whole trajectory, good members included, as `.trajectory`.
        """
        status = np.asarray(self.status)
        if np.any(status != OK):
            raise SimulationError(self)
        return self


class SimulationError(RuntimeError):
    """A simulation that failed; `.trajectory` holds all members, `.members` the failed indices."""

    def __init__(self, trajectory: Trajectory):
        status = np.asarray(trajectory.status)
        self.trajectory = trajectory
        self.members = [tuple(int(i) for i in index) for index in np.argwhere(status != OK)]
        if status.ndim == 0:
            message = REASONS[int(status)]
        else:
            lines = [
                f"  member {index[0] if len(index) == 1 else index}: {REASONS[int(status[index])]}"
                for index in self.members
            ]
            message = f"{len(lines)} of {status.size} simulations failed:\n" + "\n".join(lines)
        super().__init__(message)
