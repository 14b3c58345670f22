"""Recordings: measured channels over time, their sample time, gaps and resampling."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from ..sensors import unit
from ..simulation.frames import from_dataset, from_frame, to_dataset, to_frame

GAP = 5.0
"""Steps of time longer than this many sample times are gaps."""

HELD = ("voltage_", "torque_")
"""Channels, by how their names begin, that a digital controller holds from sample to sample."""

_JITTER = 0.02
"""Steps of time that differ by less than this share count as equal."""


class RecordingError(ValueError):
    """A recording that cannot be used; the message names file, column, found and allowed."""


@dataclass(frozen=True)
class Recording:
    """Measured `channels` in SI units at rising `times` [s].

    `repairs` says what was mended and what was noticed; `source` is the file or another name for
    messages. Nothing here changes a recording: every method gives a new one.
    """

    times: np.ndarray
    channels: Mapping[str, np.ndarray]
    repairs: tuple[str, ...] = ()
    source: str = "recording"

    def __post_init__(self) -> None:
        if self.times.ndim != 1:
            raise RecordingError(f"{self.source}: times: found shape {self.times.shape}; a run has one axis.")
        for name, values in self.channels.items():
            if np.shape(values) != self.times.shape:
                raise RecordingError(
                    f"{self.source}: {name}: found shape {np.shape(values)}, times has {self.times.shape}."
                )
        if len(self) < 2:
            raise RecordingError(f"{self.source}: {len(self)} complete row(s); at least two are needed.")
        if not np.all(np.diff(self.times) > 0):
            raise RecordingError(f"{self.source}: time does not rise; samples must be in order of time.")

    def __repr__(self) -> str:
        span = f"{self.times[-1] - self.times[0]:.6g} s every {self.sample_time:.4g} s"
        names = ", ".join(f"{name} [{unit(name)}]" for name in self.channels)
        return f"Recording({self.source}: {len(self)} samples, {span}; {names}; {len(self.repairs)} repairs)"

    def __len__(self) -> int:
        return len(self.times)

    def __getitem__(self, channel: str) -> np.ndarray:
        if channel not in self.channels:
            raise KeyError(f"no channel {channel!r}; there are {', '.join(self.channels)}.")
        return self.channels[channel]

    def to_pandas(self) -> Any:
        """A `pandas.DataFrame` of the channels by `time` [s]; needs the extra `frames`."""
        return to_frame(self.times, self.channels)

    def to_xarray(self) -> Any:
        """An `xarray.Dataset` of the channels over `time` [s] with their units; extra `frames`."""
        return to_dataset(self.times, self.channels)

    @classmethod
    def from_pandas(cls, frame: Any, source: str = "DataFrame") -> "Recording":
        """The recording in a DataFrame of channels in SI units; raises `ValueError` or `RecordingError`."""
        return cls(*from_frame(frame), source=source)

    @classmethod
    def from_xarray(cls, dataset: Any, source: str = "Dataset") -> "Recording":
        """The recording in a Dataset of channels in SI units; raises `ValueError` or `RecordingError`."""
        return cls(*from_dataset(dataset), source=source)

    @property
    def sample_time(self) -> float:
        """Typical step of time [s]: the mean of all steps but those over lost rows."""
        steps = np.diff(self.times)
        return float(np.mean(steps[steps <= 1.5 * np.median(steps)]))

    @property
    def uniform(self) -> bool:
        """True if every step is the sample time, to 2 % and to the rounding of times to their digits."""
        step, digit = self.sample_time, _last_digit(self.times)
        rounding = 1.01 * digit if digit <= step / 4 else 0.0
        return bool(np.all(np.abs(np.diff(self.times) - step) <= _JITTER * step + rounding))

    def gaps(self) -> np.ndarray:
        """Indices of the samples after which time jumps by more than `GAP` sample times."""
        return np.flatnonzero(np.diff(self.times) > GAP * self.sample_time)

    def noting(self, *repairs: str) -> "Recording":
        """The same with more `repairs` said."""
        return replace(self, repairs=(*self.repairs, *repairs))

    def window(self, start: int, stop: int) -> "Recording":
        """Samples `start` up to, not including, `stop`."""
        channels = {name: values[start:stop] for name, values in self.channels.items()}
        return replace(self, times=self.times[start:stop], channels=channels)

    def split_at_gaps(self) -> list["Recording"]:
        """The pieces between gaps, in order; a lone sample between two gaps is none."""
        edges = [0, *(self.gaps() + 1).tolist(), len(self)]
        return [self.window(a, b) for a, b in pairwise(edges) if b - a >= 2]

    def to_uniform(
        self, sample_time: float | None = None, held: Collection[str] | None = None
    ) -> "Recording":
        """The same motion at equal steps of `sample_time` [s] (default: its own).

        Channels in `held` (default: every voltage and torque) stay at a value until the next
        sample, as a digital controller's output does; each new value is their mean over the step
        that it stands for, so that a coarser step keeps the impulse. All others are read off the
        straight line between samples: what a simulation gives at the same instants compares with
        them as it stands.

        **Raises** `RecordingError` if there are gaps; see `split_at_gaps`.
        """
        if len(self.gaps()):
            at = self.times[self.gaps()[0]]
            raise RecordingError(f"{self.source}: time jumps after {at:.6g} s; split_at_gaps() comes first.")
        own = self.sample_time
        step = own if sample_time is None else sample_time
        if self.uniform:
            times = np.linspace(self.times[0], self.times[-1], len(self))
            if abs(step - own) <= 1e-6 * own:
                return replace(self, times=times)
        else:
            times = self.times
        count = int((times[-1] - times[0]) / step * (1 + 1e-9)) + 1
        if count < 2:
            raise RecordingError(
                f"{self.source}: found {times[-1] - times[0]:.4g} s of data; "
                f"a sample time of {step:.4g} s leaves {count} sample(s)."
            )
        grid = times[0] + step * np.arange(count)
        if held is None:
            held = [name for name in self.channels if name.startswith(HELD)]
        channels = {
            name: _mean_of_held(times, values, grid, step) if name in held else np.interp(grid, times, values)
            for name, values in self.channels.items()
        }
        longest = np.max(np.diff(self.times))
        note = f"resampled from {len(self)} samples to {count} at equal steps of {step:.6g} s"
        if not self.uniform:
            note += f" (steps were up to {longest:.6g} s)"
        return Recording(grid, channels, (*self.repairs, note), self.source)


def _mean_of_held(times: np.ndarray, values: np.ndarray, grid: np.ndarray, step: float) -> np.ndarray:
    """Mean over `[t, t + step]`, t in `grid`, of what holds each of `values` until the next of `times`."""
    edges = np.append(times, max(times[-1], grid[-1]) + step)
    # deviations from the first value: the running integral then loses no digits to a large offset
    integral = np.concatenate([[0.0], np.cumsum((values - values[0]) * np.diff(edges))])
    ends = np.interp(np.append(grid, grid[-1] + step), edges, integral)
    return values[0] + np.diff(ends) / step


def _last_digit(times: np.ndarray) -> float:
    """Unit of the last decimal [s] that `times` are given in; 0 beyond a nanosecond."""
    for digits in range(10):
        scaled = times * 10.0**digits
        if np.max(np.abs(scaled - np.round(scaled))) < 1e-3:
            return 10.0**-digits
    return 0.0
