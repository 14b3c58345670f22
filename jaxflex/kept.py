"""Programs kept as they were traced, so that a later process that finds them need not trace them again.

JAX keeps compiled programs but looks them up by the traced one, and tracing is most of a warm start.
Like the compiled ones, they are only as trustworthy as whoever may write to the cache.
"""

import hashlib
import importlib
import importlib.util
import io
import os
import pickle
import sys
import time
import warnings
from collections.abc import Callable
from functools import partial, wraps
from pathlib import Path
from threading import RLock, get_ident
from types import BuiltinFunctionType, FunctionType
from typing import Any

import equinox as eqx
import jax
import jax.tree_util as jtu
import numpy as np
from jax.core import Tracer

# whose functions and classes are what their names and versions say
OWN = ("jaxflex", "controllers")
OTHERS = ("jax", "numpy", "equinox", "diffrax", "optimistix", "lineax")
PLAIN = (bool, int, float, complex, str, bytes, type(None), type(Ellipsis))
SETTINGS = ("jax_enable_x64", "jax_default_matmul_precision", "jax_numpy_dtype_promotion")
DEBUGGING = ("jax_disable_jit", "jax_debug_nans", "jax_debug_infs")
STARTED = time.time()  # sources changed since are not those that this process runs


class Unkept(Exception):
    """No file can stand for this program in another process."""


class Slot:
    """Where an array goes among the results."""


def kept(function: Callable, **options: Any) -> Callable:
    """`function` of pytrees under `jit`, with the cache of `set_up` keeping its traced program too.

    What is not an array is constant, as in `equinox.filter_jit`, which takes the call where there
    is no cache, where arguments are traced or lie on other devices, and where the function, or a
    function or class among the constants, is of none of the packages `OWN` and `OTHERS`: it may be
    another tomorrow under the same name. `options` as for `jax.jit`.
    """
    plain = eqx.filter_jit(function, **options)
    programs: dict[Any, Callable | None] = {}
    tracing = RLock()  # threads that want the same program wait for the first of them

    @wraps(function)
    def call(*args: Any, **named: Any) -> Any:
        folder = jax.config.jax_compilation_cache_dir  # pyright: ignore
        everything, tree = jtu.tree_flatten((args, named))
        leaves = [leaf for leaf in everything if _is_array(leaf)]
        debugging = any(getattr(jax.config, name) for name in DEBUGGING)
        if folder is None or debugging or any(_is_elsewhere(leaf) for leaf in leaves):
            return plain(*args, **named)
        fixed = tuple(Slot if _is_array(leaf) else leaf for leaf in everything)
        kinds = tuple((leaf.shape, leaf.dtype, _is_weak(leaf)) for leaf in leaves)
        key = (tree, fixed, kinds, folder, _settings())

        def flat(*leaves):
            arrays = iter(leaves)
            given, called = jtu.tree_unflatten(tree, [next(arrays) if p is Slot else p for p in fixed])
            return function(*given, **called)

        if key not in programs:
            with tracing:
                if key not in programs:
                    try:
                        name = named_for_good((function, *_shaped((args, named))))
                        file = Path(folder) / "traced" / name
                        programs[key] = _program(flat, _shaped(leaves), file, options)
                    except Unkept:
                        programs[key] = None
        program = programs[key]
        return plain(*args, **named) if program is None else program(leaves)

    return call


def _is_array(leaf: Any) -> bool:
    return isinstance(leaf, (jax.Array, np.ndarray, np.generic))


def _is_weak(leaf: Any) -> bool:
    return getattr(leaf, "weak_type", False)


def _settings() -> tuple:
    return (*(getattr(jax.config, name) for name in SETTINGS), os.environ.get("EQX_ON_ERROR"))


def _shaped(value: Any) -> Any:
    """`value` with the shape and type of every array in its place."""

    def shape(x):
        return jax.ShapeDtypeStruct(x.shape, x.dtype, weak_type=_is_weak(x)) if _is_array(x) else x

    return jtu.tree_map(shape, value)


def _is_elsewhere(leaf: Any) -> bool:
    """True of what is traced, and of arrays on several devices or on one of another kind."""
    if isinstance(leaf, Tracer):
        return True
    if not isinstance(leaf, jax.Array):
        return False
    devices = leaf.devices()
    return len(devices) != 1 or next(iter(devices)).platform != jax.default_backend()


def _program(flat: Callable, shapes: list, file: Path, options: dict) -> Callable:
    """The program in `file`, traced and written there if it is not."""
    try:
        form, data = _Reader(io.BytesIO(file.read_bytes())).load()
        exported = jax.export.deserialize(data)
    except Exception:  # not there, or of no use
        form, data = _traced(flat, shapes)
        exported = jax.export.deserialize(data)  # as the next process will find it
        _write(file, form, data)
    run = jax.jit(exported.call, **options)
    places, tree = jtu.tree_flatten(form)

    def call(leaves):
        results = iter(run(*leaves))
        return jtu.tree_unflatten(tree, [next(results) if isinstance(p, Slot) else p for p in places])

    return call


def _traced(flat: Callable, shapes: list) -> tuple[Any, bytearray]:
    """The form of the results, with slots for arrays, and the program that computes these, as a file holds it."""
    forms = []

    def arrays(*leaves):
        results = flat(*leaves)
        forms.append(jtu.tree_map(lambda leaf: Slot() if eqx.is_array(leaf) else leaf, results))
        return [leaf for leaf in jtu.tree_leaves(results) if eqx.is_array(leaf)]

    try:
        data = jax.export.export(jax.jit(arrays))(*shapes).serialize()
    except Exception as error:
        # it calls back to Python; or the function refuses its arguments, and will again
        raise Unkept from error
    return forms[-1], data


def _write(file: Path, form: Any, data: bytearray) -> None:
    _described(form)  # or it could not be read again
    unfinished = file.with_name(f"{file.name}.{os.getpid()}.{get_ident()}")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with unfinished.open("wb") as stream:
            _Writer(stream).dump((form, bytes(data)))
        unfinished.replace(file)
    except OSError as error:
        warnings.warn(
            f"a traced program could not be kept, and will be traced again by the next process: {error}; "
            "make the folder writable, or name another in JAXFLEX_CACHE.",
            stacklevel=2,
        )


class _Writer(pickle.Pickler):
    """Writes the constants of modules by name: what is read has to be the same object."""

    def persistent_id(self, obj: Any) -> str | None:
        return _constant_name(obj)


class _Reader(pickle.Unpickler):
    def persistent_load(self, pid: str) -> Any:
        module, _, name = pid.rpartition(":")
        return getattr(importlib.import_module(module), name)


def named_for_good(value: Any) -> str:
    """A name for `value`, a pytree of constants, that is the same in every process of these versions.

    **Raises** `Unkept` if there is none.
    """
    text = f"{_versions()} {_settings()} {_described(value)}"
    return hashlib.sha256(text.encode()).hexdigest()


def _versions() -> str:
    """Versions of what programs are traced by, and the source of the library's own packages."""
    versions = [getattr(sys.modules.get(name), "__version__", "") for name in OTHERS]
    digest = hashlib.sha256(" ".join([sys.version, jax.default_backend(), *versions]).encode())
    for name in OWN:
        found = importlib.util.find_spec(name)
        for folder in (found.submodule_search_locations or []) if found else []:
            for path in sorted(Path(folder).rglob("*.py")):
                if path.stat().st_mtime > STARTED:
                    raise Unkept(f"{path} is newer than what this process imported")
                digest.update(path.read_bytes())
    return digest.hexdigest()


def _described(value: Any) -> str:
    """What `value` is, piece by piece, a line each."""
    parts: list[str] = []
    _describe(value, parts)
    return "\n".join(parts)


def _describe(value: Any, parts: list[str]) -> None:
    kind = type(value)
    if kind in PLAIN or (kind is type and value in PLAIN):
        parts.append(repr(value))
    elif isinstance(value, (type, FunctionType, BuiltinFunctionType)):
        parts.append(_public_name(value))
    elif isinstance(value, partial):
        _describe(("partial", value.func, value.args, value.keywords), parts)
    elif isinstance(value, np.dtype):
        parts.append(value.str)
    elif isinstance(value, jax.ShapeDtypeStruct):
        parts.append(f"{value.shape} {value.dtype} {value.weak_type}")
    elif isinstance(value, (tuple, list)):
        parts.append(f"{_public_name(kind)} {len(value)}")
        for item in value:
            _describe(item, parts)
    elif isinstance(value, frozenset):
        parts.append(f"frozenset {sorted(_described(item) for item in value)}")
    elif isinstance(value, jtu.PyTreeDef):
        _describe((value.node_data(), value.children()), parts)
    elif isinstance(value, dict):
        parts.append(f"dict {len(value)}")
        for item in value.items():
            _describe(item, parts)
    elif isinstance(value, eqx.Module):
        parts.append(_public_name(kind))
        _describe(dict(vars(value)), parts)
    elif isinstance(value, Slot):
        parts.append("array")
    else:
        name = _constant_name(value)
        if name is None:
            raise Unkept(f"{value!r} has no name of its own")
        parts.append(name)


def _constant_name(value: Any) -> str | None:
    """`module:name` of an object that a module of a known version holds, as of its own class; else None."""
    module = type(value).__module__
    if module.partition(".")[0] not in (*OWN, *OTHERS):
        return None
    names = [name for name, found in vars(sys.modules[module]).items() if found is value]
    return f"{module}:{names[0]}" if names else None


def _public_name(value: Any) -> str:
    """Module and name of a class or function of a known version."""
    module, name = value.__module__ or "", value.__qualname__
    if module.partition(".")[0] not in (*OWN, *OTHERS, "builtins", "jaxlib"):
        raise Unkept(f"{module}.{name} may change without notice")
    found = sys.modules.get(module)
    for part in name.split("."):
        found = getattr(found, part, None)
    while found is not value:  # it may be known by what decorates it
        found = getattr(found, "__wrapped__", None)
        if found is None:
            raise Unkept(f"{module}.{name} is not what has that name")
    return f"{module}.{name}"
