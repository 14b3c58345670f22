"""What an effect is: where it acts, and what it adds there."""

from abc import abstractmethod

import equinox as eqx

from ..scalars import Scalar


class AbstractJointEffect(eqx.Module):
    """A torque that a joint feels beside its motor: `effect(angle, rate)` [N m].

    A new effect is a class with a `name`, a `location` such as `"joint_1"`, its
    parameters as scalars of which zero means absent, and `__call__`.
    """

    name: eqx.AbstractClassVar[str]
    location: eqx.AbstractVar[str]

    @abstractmethod
    def __call__(self, angle: Scalar, rate: Scalar) -> Scalar:
        """Torque on the joint [N m] at its angle [rad] and rate [rad/s]."""

    def __check_init__(self):
        joint_index(self.location, self.name)

    @property
    def joint(self) -> int:
        """Index of the joint that the effect acts on, counted from zero."""
        return joint_index(self.location, self.name)


def joint_index(location: str, name: str) -> int:
    """Index of the joint named by `location`; raises `ValueError` for anything else."""
    place, _, number = location.partition("_")
    if place != "joint" or not number.isdigit() or int(number) < 1:
        raise ValueError(
            f"effect {name!r} acts at a joint: location must be joint_1, joint_2 …, not {location!r}."
        )
    return int(number) - 1
