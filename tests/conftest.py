"""Double precision for every test, compiled programs shared for a run, and the data that is kept elsewhere."""

import gc
import os
import tempfile
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # workers side by side would fight for the cores
os.environ.setdefault("JAX_DISABLE_MOST_OPTIMIZATIONS", "1")  # compiles faster, and most programs run once

import jax
import pytest
from hypothesis import settings

jax.config.update("jax_enable_x64", True)

# as in jaxflex.set_up, not imported from there: the types of what is imported here would go unchecked
if jax.__version_info__ < (0, 11):
    EMITTERS = "--xla_cpu_use_fusion_emitters=false"  # programs compile in two thirds of the time
    os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} {EMITTERS}".strip()

settings.register_profile("seeded", derandomize=True)  # what passes once passes again
settings.load_profile("seeded")

SHARED = Path(__file__).resolve().parents[2] / "shared"


def pytest_configure(config):
    """What one worker of this run has compiled the others load; another run begins anew."""
    if not hasattr(config, "workerinput"):
        folder = tempfile.TemporaryDirectory(prefix="jaxflex-tests-", ignore_cleanup_errors=True)
        os.environ["JAX_COMPILATION_CACHE_DIR"] = folder.name  # workers begin with it
        config.add_cleanup(folder.cleanup)
    jax.config.update("jax_compilation_cache_dir", os.environ["JAX_COMPILATION_CACHE_DIR"])
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.3)


def pytest_collection_finish(session):
    """What was imported stays: looking through it again and again takes a tenth of the time."""
    gc.freeze()
    gc.set_threshold(50_000, 20, 50)


@pytest.fixture(scope="module", autouse=True)
def compiled_programs(request):
    """Programs of one module are dropped after it: those of all would take some gigabytes a worker.

    Those of a module marked `optimised`, which run longer than they compile, are made as users get them.
    """
    plain = request.node.get_closest_marker("optimised") is None
    jax.config.update("jax_disable_most_optimizations", plain)
    yield
    jax.clear_caches()
    gc.collect()


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of measured data; tests that need it skip where it is absent."""
    if not SHARED.is_dir():
        pytest.skip(f"measured data is not here: {SHARED} is absent")
    return SHARED
