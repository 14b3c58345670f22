"""What an effect is: physics that the nominal arm leaves out, each with zero meaning absent."""

from abc import abstractmethod
from typing import Any

import equinox as eqx
from jaxtyping import Array, Float, PyTree

from ..brief import brief
from ..scalars import Scalar


class AbstractEffect(eqx.Module):
    """One missing piece of physics at one place.

    A new effect derives from one of the four interfaces below, which say where it acts:
    at a joint, in the drive, on the body of the arm, or in a sensor. It states

    - `name`: as files and reports call it
    - `looks_like`: one sentence on what it leaves behind in a residual
    - `place`: `"joint"`, `"motor"` (a joint that has one), `"link"`, `"tip"`, `"base"`
      or `"channel"`
    - `units`: of each parameter, in the order of the fields
    - `location`: `joint_1`, `link_2`, `tip`, `base`, or the name of a channel

    and its parameters as scalars, of which the first is zero where the effect is absent.
    """

    name: eqx.AbstractClassVar[str]
    looks_like: eqx.AbstractClassVar[str]
    place: eqx.AbstractClassVar[str]
    units: eqx.AbstractClassVar[dict[str, str]]
    location: eqx.AbstractVar[str]

    __repr__ = brief

    def __check_init__(self):
        if self.place in ("tip", "base"):
            if self.location != self.place:
                raise ValueError(
                    f"effect {self.name!r}: location must be {self.place!r}, not {self.location!r}."
                )
        elif self.place != "channel":
            numbered(self.location, "link" if self.place == "link" else "joint", self.name)

    @property
    def index(self) -> int:
        """Index of the joint or link that the effect acts on, counted from zero."""
        return numbered(self.location, "link" if self.place == "link" else "joint", self.name)


class AbstractJointEffect(AbstractEffect):
    """A torque that a joint feels beside its motor; most remember nothing."""

    def initial(self) -> PyTree:
        """Memory at the start, a pytree of scalars; None for an effect without."""
        return None

    def memory_rate(self, rate: Scalar, memory: PyTree) -> PyTree:
        """Time derivative of the memory at a rate of the joint [rad/s]."""
        return None

    @abstractmethod
    def __call__(self, angle: Scalar, rate: Scalar, time: Scalar) -> Scalar:
        """Torque on the joint [N m] at its angle [rad], its rate [rad/s] and time [s].

        One that remembers anything takes its `memory` as a fourth argument.
        """


class AbstractDriveEffect(AbstractEffect):
    """Something between a command and its torque: in the amplifier, the winding or the magnets.

    An effect overrides what it changes; left alone, a command arrives as it is, the motor
    stays what it was, and nothing is remembered.
    """

    def initial(self) -> PyTree:
        """Memory at the start, a pytree of scalars; None for an effect without."""
        return None

    def command(self, command: Scalar, memory: PyTree) -> Scalar:
        """What reaches the motor of a command [V], [A] or [N m]."""
        return command

    def motor(self, motor: Any, memory: PyTree) -> Any:
        """The `DCMotor` as it is now."""
        return motor

    def rate(self, command: Scalar, current: Scalar, motor: Any, memory: PyTree) -> PyTree:
        """Time derivative of the memory."""
        return None


class AbstractBodyEffect(AbstractEffect):
    """A change of the arm itself: a part that is heavier, softer or rougher than was said."""

    @abstractmethod
    def apply(self, arm: Any) -> Any:
        """The `Arm` with the effect in it."""


class AbstractSensorEffect(AbstractEffect):
    """A fault of an instrument: what it shows in place of the truth."""

    @abstractmethod
    def read(self, times: Float[Array, " times"], signal: Float[Array, " times"]) -> Float[Array, " times"]:
        """What the instrument shows of `signal` at `times` [s]."""


def numbered(location: str, part: str, name: str) -> int:
    """Index of the `part` named by `location`; raises `ValueError` for anything else."""
    place, _, number = location.partition("_")
    if place != part or not number.isdigit() or int(number) < 1:
        raise ValueError(
            f"effect {name!r} acts at a {part}: location must be {part}_1, {part}_2 …, not {location!r}."
        )
    return int(number) - 1
