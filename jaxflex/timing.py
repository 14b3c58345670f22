"""How long a computation takes, and how much of that is waiting for the compiler."""

import time
from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import equinox as eqx
import jax


class Timing(NamedTuple):
    """Seconds of the stages of one computation: `trace` and `lower` in Python, `compile` in XLA, `run`."""

    trace: float
    lower: float
    compile: float
    run: float

    def __repr__(self) -> str:
        return (
            f"traced in {self.trace:.2g} s, lowered in {self.lower:.2g} s, compiled in {self.compile:.2g} s, "
            f"ran in {self.run:.2g} s"
        )


def timed(function: Callable[..., Any]) -> Callable[..., tuple[Any, Timing]]:
    """`function` of pytrees under `jit`, each call compiled anew and timed: `(result, Timing)`.

        run, seconds = jf.timed(jf.simulate)(arm, controller, reference, times)

    What is not an array is constant, as in `eqx.filter_jit`. A program that is in the cache of
    `set_up` has little to compile. Call it outside of `jit`; a `Trajectory` is not yet checked.
    """

    def call(*args: Any, **options: Any) -> tuple[Any, Timing]:
        arrays, constants = eqx.partition((args, options), eqx.is_array)
        others: list[Any] = []

        def pure(arrays):
            given, named = eqx.combine(arrays, constants)
            results, rest = eqx.partition(function(*given, **named), eqx.is_array)
            others.append(rest)
            return results

        began = [time.perf_counter()]

        def done(value):
            began.append(time.perf_counter())
            return value

        traced = done(jax.jit(pure).trace(arrays))
        lowered = done(traced.lower())
        program = done(lowered.compile())
        results = done(jax.block_until_ready(program(arrays)))
        stages = [after - before for before, after in pairwise(began)]
        return eqx.combine(results, others[-1]), Timing(*stages)

    return call
