"""Controllers made of controllers: sums, filters behind them, the hold of a digital drive."""

from collections.abc import Sequence
from functools import reduce
from operator import add

import equinox as eqx
from jaxtyping import PyTree

from jaxflex import AbstractController, Measurement, Scalar, Setpoint, scalar

from .biquad import Biquad


class Sum(AbstractController):
    """Laws whose commands add up, such as feedback and feedforward."""

    laws: tuple[AbstractController, ...] = eqx.field(converter=tuple)

    def period(self) -> Scalar | None:
        """Period [s] of the first law that has one."""
        return next((p for p in (law.period() for law in self.laws) if p is not None), None)

    def initial(self) -> PyTree:
        """The memories of the laws."""
        return tuple(law.initial() for law in self.laws)

    def begin(self, measurement: Measurement) -> PyTree:
        """The memories of the laws where the run begins."""
        return tuple(law.begin(measurement) for law in self.laws)

    def command(
        self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint
    ) -> tuple[Scalar, ...]:
        """Sum of the commands, joint by joint."""
        commands = [law.command(t, m, measurement, setpoint) for law, m in self._pairs(memory)]
        return tuple(reduce(add, values) for values in zip(*commands, strict=True))

    def rate(self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint) -> PyTree:
        """Rates of the memories."""
        return tuple(law.rate(t, m, measurement, setpoint) for law, m in self._pairs(memory))

    def advance(
        self, period: Scalar, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint
    ) -> PyTree:
        """The memories, each as its law advances it."""
        return tuple(law.advance(period, t, m, measurement, setpoint) for law, m in self._pairs(memory))

    def _pairs(self, memory):
        return zip(self.laws, memory, strict=True)


class Filtered(AbstractController):
    """`law` with a filter on the command of each joint, such as a `notch`; None where there is none."""

    law: AbstractController
    filters: tuple[Biquad | None, ...]

    def __init__(self, law: AbstractController, filters: Sequence[Biquad | None]):
        self.law, self.filters = law, tuple(filters)
        sampled = {f.period is not None for f in self.filters if f is not None}
        if len(sampled) > 1:
            raise ValueError("Filtered: some filters are sampled and some are not; sample all or none.")

    def period(self) -> Scalar | None:
        """Period [s] of the law, else of the filters."""
        own = [f.period for f in self.filters if f is not None and f.period is not None]
        return own[0] if own else self.law.period()

    def initial(self) -> PyTree:
        """Memory of the law, and filters at rest."""
        return self.law.initial(), self._rest()

    def begin(self, measurement: Measurement) -> PyTree:
        """Memory of the law where the run begins, and filters at rest."""
        return self.law.begin(measurement), self._rest()

    def _rest(self):
        return tuple(None if f is None else (scalar(0.0), scalar(0.0)) for f in self.filters)

    def command(
        self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint
    ) -> tuple[Scalar, ...]:
        """The law's commands through their filters."""
        inner, states = memory
        asked = self.law.command(t, inner, measurement, setpoint)
        return tuple(
            u if f is None else f.output(x, u) for f, x, u in zip(self.filters, states, asked, strict=True)
        )

    def rate(self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint) -> PyTree:
        """Rates of the law's memory and of the filters."""
        inner, states = memory
        asked = self.law.command(t, inner, measurement, setpoint)
        slopes = tuple(
            None if f is None else f.rate(x, u) for f, x, u in zip(self.filters, states, asked, strict=True)
        )
        return self.law.rate(t, inner, measurement, setpoint), slopes

    def advance(
        self, period: Scalar, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint
    ) -> PyTree:
        """Memory one sample later."""
        inner, states = memory
        asked = self.law.command(t, inner, measurement, setpoint)
        after = tuple(
            None if f is None else f.advance(period, x, u)
            for f, x, u in zip(self.filters, states, asked, strict=True)
        )
        return self.law.advance(period, t, inner, measurement, setpoint), after


class ZeroOrderHold(AbstractController):
    """`law` computed once every `interval` [s] and held in between, as a digital drive does.

    The simulation steps to every sample. Memory goes from one sample to the next by
    `advance`: exactly for laws made for a period, by an Euler step for the others.
    """

    law: AbstractController
    interval: Scalar = eqx.field(converter=scalar)

    def period(self) -> Scalar | None:
        """The interval [s]."""
        return self.interval

    def initial(self) -> PyTree:
        """Memory of the law."""
        return self.law.initial()

    def begin(self, measurement: Measurement) -> PyTree:
        """Memory of the law where the run begins."""
        return self.law.begin(measurement)

    def command(
        self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint
    ) -> tuple[Scalar, ...]:
        """Command of the law at a sample."""
        return self.law.command(t, memory, measurement, setpoint)

    def rate(self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint) -> PyTree:
        """Rate of the law's memory."""
        return self.law.rate(t, memory, measurement, setpoint)

    def advance(
        self, period: Scalar, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint
    ) -> PyTree:
        """The law's memory one sample later."""
        return self.law.advance(period, t, memory, measurement, setpoint)
