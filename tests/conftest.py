"""Double precision for every test, a compilation cache off, and the data that is kept elsewhere."""

import gc
import os
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # workers side by side would fight for the cores

import jax
import pytest

jax.config.update("jax_enable_x64", True)

SHARED = Path(__file__).resolve().parents[2] / "shared"


@pytest.fixture(scope="module", autouse=True)
def compiled_programs():
    """Programs of one module are dropped after it: those of all would take some gigabytes a worker."""
    yield
    jax.clear_caches()
    gc.collect()


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of measured data; tests that need it skip where it is absent."""
    if not SHARED.is_dir():
        pytest.skip(f"measured data is not here: {SHARED} is absent")
    return SHARED
