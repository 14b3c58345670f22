"""A model as text that fits a screen: the call that makes it, without what is left at its default."""

import dataclasses
from typing import Any

import jax
import numpy as np
from jax.core import Tracer

_WIDTH = 96
_SHOWN = 8
"""Parts of a tuple, or elements of an array, that are shown one by one."""


def brief(self: Any) -> str:
    """Text for `repr`: a dataclass as the call that makes it, fields at their default left out."""
    given = []
    for field in dataclasses.fields(self):
        value = getattr(self, field.name, None)
        if not _same(value, _default(field)):
            given.append(f"{field.name}={show(value)}")
    return _wrapped(f"{type(self).__name__}(", given, ")")


def show(value: Any) -> str:
    """A field's value: numbers to six digits, a batch as its shape and range."""
    if isinstance(value, tuple) and not hasattr(value, "_fields"):
        shown = [show(item) for item in value[:_SHOWN]]
        more = [f"… {len(value)} in all"] if len(value) > _SHOWN else []
        return _wrapped("(", shown + more, ",)" if len(value) == 1 else ")")
    if isinstance(value, Tracer):
        return f"traced {value.dtype}{list(value.shape)}"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, jax.ShapeDtypeStruct):
        return f"{value.dtype}{list(value.shape)}"
    if hasattr(value, "shape") and hasattr(value, "dtype"):
        return _array(value)
    text = repr(value)
    return f"{type(value).__name__}(…)" if "\n" in text and not _ours(value) else text


def _ours(value: Any) -> bool:
    return getattr(type(value), "__repr__", None) is brief


def _array(value: Any) -> str:
    try:
        found = np.asarray(value)
    except TypeError:  # a random key, a placeholder without numbers
        return f"{value.dtype}{list(value.shape)}"
    if found.ndim == 0:
        return f"{found.item():.6g}" if np.issubdtype(found.dtype, np.inexact) else repr(found.item())
    if not np.issubdtype(found.dtype, np.number) or not found.size:
        return f"{found.dtype}{list(found.shape)}"
    if found.ndim == 1 and found.size <= _SHOWN:
        return "[" + ", ".join(f"{item:.6g}" for item in found.tolist()) + "]"
    if found.min() == found.max():
        return f"{found.dtype}{list(found.shape)} of {found.flat[0]:.6g}"
    return f"{found.dtype}{list(found.shape)} from {found.min():.6g} to {found.max():.6g}"


def _default(field: dataclasses.Field) -> Any:
    if field.default_factory is not dataclasses.MISSING:
        return field.default_factory()
    return field.default


def _same(value: Any, default: Any) -> bool:
    """True if a field is at its default, which a converter may have made an array of."""
    if default is dataclasses.MISSING or isinstance(value, Tracer):
        return False
    if value is default:
        return True
    if isinstance(default, (int, float)) and not isinstance(default, bool):
        if isinstance(value, tuple) and len(value) == 1:
            value = value[0]
        return getattr(value, "shape", None) == () and show(value) == f"{default:.6g}"
    if dataclasses.is_dataclass(default):
        return repr(value) == repr(default)
    return type(value) is type(default) and isinstance(value, (str, int, tuple)) and value == default


def _wrapped(head: str, parts: list[str], tail: str) -> str:
    line = head + ", ".join(parts) + tail
    if len(line) <= _WIDTH and "\n" not in line:
        return line
    lines = [""]
    for part in (f"{part}," for part in parts):
        alone = "\n" in part or "\n" in lines[-1]
        if lines[-1] and (alone or len(lines[-1]) + len(part) > _WIDTH - 4):
            lines.append("")
        lines[-1] += f" {part}" if lines[-1] else part
    inner = "\n".join(lines).rstrip(",").replace("\n", "\n  ")
    single = "," if tail.startswith(",") else ""
    return f"{head}\n  {inner}{single}\n{tail.removeprefix(',')}"
