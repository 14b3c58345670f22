"""Any model in a file: its numbers by equinox, its structure checked when it is read."""

import json
import re
from pathlib import Path
from typing import TypeVar

import equinox as eqx
import jax
from jaxtyping import PyTree

Model = TypeVar("Model", bound=PyTree)
_KIND = "jaxflex model 1"


class ModelFileError(ValueError):
    """A model file that cannot be used; the message names the file and what does not fit."""


def save_model(path: str | Path, model: PyTree) -> None:
    """Write the numbers of `model`, any pytree: an arm, a controller, a trajectory, a neural network.

    The first line of the file is JSON and says what the numbers belong to; the rest is
    `equinox.tree_serialise_leaves`. For an arm that people read, see `save_arm`.
    """
    with open(path, "wb") as stream:
        stream.write(json.dumps({"kind": _KIND, "leaves": _leaves(model), "shape": _shape(model)}).encode())
        stream.write(b"\n")
        eqx.tree_serialise_leaves(stream, model)


def load_model(path: str | Path, like: Model) -> Model:
    """The model in the file at `path`; `like` is one of the same structure, whatever its numbers.

    **Raises** `ModelFileError` for a file that `save_model` did not write, and where the
    structure differs: it names the first part that does, what the file holds and what `like` has.
    """
    try:
        with open(path, "rb") as stream:
            try:
                head = json.loads(stream.readline())
                stored, shape = head["leaves"], head["shape"]
                known = head["kind"] == _KIND
            except (ValueError, KeyError, TypeError):
                known = False
            if not known:
                raise ModelFileError(f"{path}: not a model file; save_model writes them.")
            _compare(str(path), stored, _leaves(like), shape, _shape(like))
            return eqx.tree_deserialise_leaves(stream, like)
    except (OSError, EOFError, RuntimeError) as error:
        raise ModelFileError(f"{path}: cannot be read: {error}.") from error


def _leaves(model: PyTree) -> dict[str, str]:
    """What each leaf is: type and shape of an array, the value of anything else."""
    found = {}
    for path, leaf in jax.tree_util.tree_flatten_with_path(model)[0]:
        name = jax.tree_util.keystr(path).lstrip(".") or "the model"
        if eqx.is_array_like(leaf) and not isinstance(leaf, (bool, int, float, complex)):
            found[name] = f"{leaf.dtype}{list(leaf.shape)}"
        elif isinstance(leaf, (bool, int, float, complex)):
            found[name] = type(leaf).__name__
        else:
            found[name] = _text(leaf)
    return found


def _shape(model: PyTree) -> str:
    """Classes and static fields, without the addresses of functions."""
    return _text(jax.tree_util.tree_structure(model))


def _text(value: object) -> str:
    return re.sub(r" at 0x[0-9a-f]+", "", str(value))


def _compare(file: str, stored: dict, wanted: dict, shape: str, wanted_shape: str) -> None:
    for name in [*wanted, *(name for name in stored if name not in wanted)]:
        if stored.get(name) != wanted.get(name):
            found = stored.get(name, "nothing")
            raise ModelFileError(
                f"{file}: {name}: the file holds {found}, the model given has {wanted.get(name, 'nothing')}; "
                "give load_model a model of the same structure and precision."
            )
    if shape != wanted_shape:
        at = next((i for i, (a, b) in enumerate(zip(shape, wanted_shape, strict=False)) if a != b), 0)
        here = slice(max(0, at - 30), at + 30)
        raise ModelFileError(
            f"{file}: what is fixed in the model differs: the file holds …{shape[here]}…, "
            f"the model given has …{wanted_shape[here]}…."
        )
