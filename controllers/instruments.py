"""A controller behind real instruments: counts of an encoder, rates from filtered differences."""

import equinox as eqx
from jaxtyping import PyTree

from jaxflex import AbstractController, Measurement, Scalar, Setpoint, quantised, scalar

from .references import scalars


class Instrumented(AbstractController):
    """`law` that reads angles and curvatures in counts, and makes their rates from those.

    **Fields**

    - `angle_step` [rad]: one count of the encoder of each joint, 2 pi / N for N counts a
      turn; zero for none
    - `curvature_step` [1/m]: one count of the strain gauge of each link
    - `smoothing` T [s]: a rate is `s / (T s + 1)` of its signal. Sampled with T equal to
      the period it is the plain difference of two readings; T must not be less.

    Counts jump, and so do rates made of them: simulate it sampled (`ZeroOrderHold`). A
    derivative passes through the rounding unchanged.
    """

    law: AbstractController
    angle_step: tuple[Scalar, ...] = eqx.field(converter=scalars)
    curvature_step: tuple[Scalar, ...] = eqx.field(converter=scalars)
    smoothing: Scalar = eqx.field(converter=scalar)

    def period(self) -> Scalar | None:
        """Period [s] of the law."""
        return self.law.period()

    def _counts(self, measurement: Measurement) -> tuple[tuple, tuple]:
        joints = len(measurement.angle)
        if not len(self.angle_step) == len(self.curvature_step) == joints:
            raise ValueError(
                f"Instrumented: angle_step and curvature_step are needed once a joint, {joints} each; "
                f"found {len(self.angle_step)} and {len(self.curvature_step)}."
            )
        angles = tuple(map(quantised, measurement.angle, self.angle_step))
        curvatures = tuple(map(quantised, measurement.curvature, self.curvature_step))
        return angles, curvatures

    def _read(self, behind: tuple[tuple, tuple], measurement: Measurement) -> Measurement:
        angles, curvatures = self._counts(measurement)

        def rates(signals, lagging):
            return tuple((s - x) / self.smoothing for s, x in zip(signals, lagging, strict=True))

        return measurement._replace(
            angle=angles,
            rate=rates(angles, behind[0]),
            curvature=curvatures,
            curvature_rate=rates(curvatures, behind[1]),
        )

    def initial(self) -> PyTree:
        """Memory of the law, and the lagging signals of the differences at zero."""
        zero = scalar(0.0)
        lagging = (zero,) * len(self.angle_step), (zero,) * len(self.curvature_step)
        return self.law.initial(), lagging

    def begin(self, measurement: Measurement) -> PyTree:
        """Memory of the law, and the lagging signals where the run begins: rates begin at zero."""
        lagging = self._counts(measurement)
        return self.law.begin(self._read(lagging, measurement)), lagging

    def command(
        self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint
    ) -> tuple[Scalar, ...]:
        """Command of the law on what the instruments show."""
        inner, lagging = memory
        return self.law.command(t, inner, self._read(lagging, measurement), setpoint)

    def rate(self, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint) -> PyTree:
        """Rates of the law's memory and of the lagging signals."""
        inner, lagging = memory
        read = self._read(lagging, measurement)
        return self.law.rate(t, inner, read, setpoint), (read.rate, read.curvature_rate)

    def advance(
        self, period: Scalar, t: Scalar, memory: PyTree, measurement: Measurement, setpoint: Setpoint
    ) -> PyTree:
        """Memory one sample later."""
        inner, lagging = memory
        read = self._read(lagging, measurement)
        after = tuple(
            tuple(x + period * v for x, v in zip(signals, rates, strict=True))
            for signals, rates in zip(lagging, (read.rate, read.curvature_rate), strict=True)
        )
        return self.law.advance(period, t, inner, read, setpoint), after
