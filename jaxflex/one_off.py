"""Programs that run once: the time to compile them is what counts."""

from collections.abc import Callable
from functools import wraps
from typing import Any

import equinox as eqx
import jax
import jax.tree_util as jtu
from jax.core import Tracer, eval_context

from .kept import kept

# XLA's newer code generator for the CPU makes code no faster here, and takes a quarter longer; the
# option to do without it is there for a time, and an option that XLA does not know is an error
OLD_EMITTERS = jax.__version_info__ < (0, 11)
HASTY: dict[str, Any] = {"xla_backend_optimization_level": 0}
if OLD_EMITTERS:
    HASTY["xla_cpu_use_fusion_emitters"] = False


def one_off(function: Callable) -> Callable:
    """`function` of pytrees under `jit`, compiled in a third of the time.

    Where it loops it runs two to six times slower: for programs that run once, and shortly.

    Of traced values it is a part of the program that is being traced, and compiled as that is.
    """
    inner, outermost = eqx.filter_jit(function), kept(function, compiler_options=HASTY)

    @wraps(function)
    def call(*args: Any, **options: Any) -> Any:
        if any(isinstance(leaf, Tracer) for leaf in jtu.tree_leaves((args, options))):
            return inner(*args, **options)
        # what depends on nothing that is traced is computed beforehand, in a program of its own
        with eval_context():
            return outermost(*args, **options)

    return call
