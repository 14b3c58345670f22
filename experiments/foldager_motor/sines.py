"""The transfer functions as an experimenter finds them: a sine in, its amplitude and phase out."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Complex, Float

import controllers as ctl
import jaxflex as jf

from .steps import TIGHT, gains, motor_arm

SETTLE, PERIODS, SAMPLES = 0.25, 3, 181  # s before reading, periods read, samples read


class Sine(jf.AbstractReference):
    """`amplitude sin(2 pi frequency t)` for the one joint; `frequency` [Hz]."""

    frequency: jf.Scalar = eqx.field(converter=jf.scalar)
    amplitude: jf.Scalar = eqx.field(converter=jf.scalar)

    def __call__(self, t: jf.Scalar) -> tuple[jf.Scalar, ...]:
        return (self.amplitude * jnp.sin(2 * jnp.pi * self.frequency * t),)

    def jumps(self) -> Float[Array, " jumps"]:
        return jnp.zeros(0)

    def end(self) -> jf.Scalar:
        return jf.scalar(0.0)


def _gain(controller, amplitude, frequency):
    read = SETTLE + jnp.linspace(0.0, PERIODS / frequency, SAMPLES)
    times = jnp.concatenate([jnp.zeros(1), read])
    run = jf.simulate(
        motor_arm("voltage"),
        controller,
        Sine(frequency, amplitude),
        times,
        method=TIGHT,
        channels=("angle_1",),
    )
    phase = 2 * jnp.pi * frequency * read
    # a free motor also keeps the angle it drifted to while it settled
    regressors = jnp.stack([jnp.sin(phase), jnp.cos(phase), jnp.ones_like(phase)], axis=1)
    in_phase, quadrature, _ = jnp.linalg.lstsq(regressors, run["angle_1"][1:])[0]
    return (in_phase + 1j * quadrature) / amplitude


def measured_gains(frequencies: Float[Array, " n"], closed: bool) -> Complex[Array, " n"]:
    """`theta / V_a` [rad/V] with the loop open, `theta / theta_d` with it closed, at `frequencies` [Hz]."""
    controller, amplitude = (gains("voltage"), 0.05) if closed else (ctl.OpenLoop(), 2.0)
    return jax.jit(jax.vmap(lambda f: _gain(controller, amplitude, f)))(frequencies)
