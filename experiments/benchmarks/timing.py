"""Seconds that a call takes: compiled first, then the best of several."""

import os
import platform
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax


def best_of(call: Callable[[], Any], tries: int = 5, clock: Callable[[], float] = time.perf_counter) -> float:
    """Shortest of `tries` runs [s] by `clock`, which a busy machine lengthens least."""
    shortest = float("inf")
    for _ in range(tries):
        began = clock()
        jax.block_until_ready(call())
        shortest = min(shortest, clock() - began)
    return shortest


def compiled(function: Callable, *arguments: Any) -> tuple[Callable[[], Any], float]:
    """A call of `function(*arguments)` already compiled, and the seconds of a processor that took, tracing included."""
    began = time.process_time()
    program = jax.jit(function).lower(*arguments).compile()
    return lambda: program(*arguments), time.process_time() - began


def machine() -> dict[str, Any]:
    """What the figures were taken on: processor, cores, load of the machine at this moment."""
    model = platform.processor()
    info = Path("/proc/cpuinfo")
    if info.exists():
        lines = [line for line in info.read_text().splitlines() if line.startswith("model name")]
        model = lines[0].partition(":")[2].strip() if lines else model
    return {
        "processor": model,
        "cores": os.cpu_count(),
        "cores used": len(os.sched_getaffinity(0)),
        "load": round(os.getloadavg()[0], 1),
        "jax": jax.__version__,
    }
