"""What a session should set before it computes: precision, compiler options, a cache of programs.

A library must not do this when imported; a notebook or a command does it in one call.
"""

import gc
import os
import warnings
from pathlib import Path

import equinox
import jax

from .one_off import OLD_EMITTERS

# One core runs a loop over the arm's motion fastest as one compiled function. XLA does that by
# itself for loops over less than a kilobyte; a batch of arms needs some megabytes.
LOOP_BYTES = 100_000_000
VECTORS = "--xla_cpu_prefer_vector_width=512"
EMITTERS = "--xla_cpu_use_fusion_emitters=false"
LOOPS = f"--xla_backend_extra_options=xla_cpu_small_while_loop_byte_threshold={LOOP_BYTES}"
FUSION = ",xla_cpu_use_multi_output_fusion"


def set_up(
    cache: str | Path | None = "~/.cache/jaxflex", devices: int | None = None, fuse: bool = False
) -> None:
    """Double precision, compiler options for small fast loops, and compiled programs kept in `cache`.

    Call it first: once JAX has computed something its compiler options are fixed, and a
    warning says so. Options already in the environment variable XLA_FLAGS stand. With
    `cache=None` nothing is kept between sessions; where there is a cache, the environment
    variable JAXFLEX_CACHE may say another place.

    `devices`: into how many the CPU is divided for `sweep`, one a core that this process may
    use unless told.

    `fuse`: let XLA compute values that several results share once instead of once for each.
    Batches under `Fixed` are two to four times as fast and compile in half the time. Off by
    default, since XLA has the option off: the compiler of jaxlib 0.10.2 aborts on batched
    solves by diffrax (`Adaptive` under `vmap`) with it. For sweeps, and diagnoses, whose slopes
    take a third of the time with it, in a process of their own.

    What has been imported by now is taken out of Python's search for garbage (`gc.freeze`), which
    saves a tenth of the time of tracing.

    A program that calls back to Python cannot be kept, and equinox's run-time checks do;
    here they give NaN instead, which every simulation looks for.
    """
    flags = os.environ.get("XLA_FLAGS", "")
    wanted = [VECTORS, LOOPS + FUSION if fuse else LOOPS]
    if OLD_EMITTERS:
        wanted.append(EMITTERS)
    missing = [option for option in wanted if option.split("=")[0] not in flags]
    if missing and _backend_runs():
        warnings.warn(
            "set_up came after the first computation: JAX's compiler options are fixed by then and "
            "simulations run several times slower; call set_up before anything else.",
            stacklevel=2,
        )
    os.environ["XLA_FLAGS"] = " ".join([flags, *missing]).strip()
    os.environ.setdefault("EQX_ON_ERROR", "nan")
    # equinox reads the variable when it is first imported, which is before this can set it
    setattr(equinox._errors, "EQX_ON_ERROR", os.environ["EQX_ON_ERROR"])  # noqa: B010
    jax.config.update("jax_enable_x64", True)
    if not _backend_runs():
        jax.config.update("jax_num_cpu_devices", devices or len(os.sched_getaffinity(0)))
    gc.freeze()  # what was imported stays, and need not be looked through again at every collection
    if cache is not None:
        folder = Path(os.environ.get("JAXFLEX_CACHE", cache)).expanduser()
        jax.config.update("jax_compilation_cache_dir", str(folder))
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)


def _backend_runs() -> bool:
    return bool(jax._src.xla_bridge.backends_are_initialized())  # pyright: ignore
