"""Run a function over many members in chunks of bounded memory, on every device there is.

A chunk is split evenly over a device mesh; on each device it is worked through in lanes,
groups small enough that what they need stays in a core's cache. Members are padded to whole
chunks, so that one more of them compiles nothing anew. Finished chunks can be kept on disk.
"""

import hashlib
import os
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import jax.tree_util as jtu
import numpy as np
from jax.experimental import multihost_utils
from jax.sharding import Mesh, NamedSharding, PartitionSpec

LANES = 64  # arms side by side in a core's cache (experiments/benchmarks)
AXIS = "members"


def sweep(
    function: Callable[[Any], Any],
    members: Any,
    *,
    chunk: int = 4096,
    lanes: int | None = None,
    mesh: Mesh | None = None,
    folder: str | Path | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Any:
    """`function` of every member, `jax.vmap(function)(members)` in bounded memory.

        sweep(lambda mass: simulate(arm.with_payload(mass), …)["tip_y"][-1], masses)

    **Arguments**

    - `function`: pure, of one member, a pytree of arrays; returns a pytree of arrays.
      Only what it returns is kept, so return what is wanted and no more.
    - `members`: a pytree of arrays with the members on the leading axis.
    - `chunk`: members computed, and held in memory, at a time.
    - `lanes`: members side by side on a device; 64 on a CPU, all at once elsewhere.
    - `mesh`: a `jax.sharding.Mesh`, of whose devices each takes an equal part; by default
      all devices of all processes (`jax.distributed`). Every process makes the same call
      and gets the whole result.
    - `folder`: where finished chunks are kept, one folder for one function. A sweep stopped
      half way and called again with the same members goes on where it was.
    - `progress(done, all)`: called after each chunk.

    **Returns** NumPy arrays, a leading axis of members before the shapes of the function's.

    **Raises** `ValueError` for members of different numbers, or of none, and for a chunk
    that is not a positive number.
    """
    leaves, tree = jtu.tree_flatten(members)
    counts = {np.shape(leaf)[0] if np.ndim(leaf) else 0 for leaf in leaves}
    if len(counts) != 1 or 0 in counts:
        raise ValueError(
            "sweep: the members must be arrays whose first axes are equal and not empty, found "
            f"first axes of {sorted(counts)}."
        )
    if chunk < 1:
        raise ValueError(f"sweep: chunk = {chunk} is not a positive number.")
    (count,) = counts
    mesh = mesh or Mesh(np.array(jax.devices()), (AXIS,))
    lanes = lanes or (LANES if jax.default_backend() == "cpu" else chunk)
    grain = lanes * mesh.size
    # small sweeps are padded to powers of two of the grain, so that few sizes are ever compiled
    whole = -(-count // grain)
    chunk = grain * min(1 << (whole - 1).bit_length(), max(1, chunk // grain))
    run = _over_devices(function, mesh, lanes)
    kept = None if folder is None else _Kept(Path(folder), leaves, chunk)
    parts, structure = [], None
    for begin in range(0, count, chunk):
        end = min(begin + chunk, count)
        part = None if kept is None else kept.load(begin)
        if part is None:
            given = [_placed(_padded(leaf[begin:end], chunk), mesh) for leaf in leaves]
            result = _gathered(run(jtu.tree_unflatten(tree, given)))
            structure = jtu.tree_structure(result)
            part = [np.asarray(leaf)[: end - begin] for leaf in jtu.tree_leaves(result)]
            if kept is not None:
                kept.save(begin, part)
        parts.append(part)
        if progress is not None:
            progress(end, count)
    if structure is None:  # every chunk was kept
        one = jtu.tree_unflatten(tree, [jnp.asarray(leaf[0]) for leaf in leaves])
        structure = jtu.tree_structure(jax.eval_shape(function, one))
    return jtu.tree_unflatten(structure, [np.concatenate(leaf) for leaf in zip(*parts, strict=True)])


@lru_cache(maxsize=32)
def _over_devices(function: Callable, mesh: Mesh, lanes: int) -> Callable:
    """A chunk's program: every device its share, `lanes` at a time."""
    spread = PartitionSpec(mesh.axis_names)

    def share(members):
        groups = jtu.tree_map(lambda leaf: leaf.reshape(-1, lanes, *leaf.shape[1:]), members)
        results = jax.lax.map(jax.vmap(function), groups)
        return jtu.tree_map(lambda leaf: leaf.reshape(-1, *leaf.shape[2:]), results)

    # members have nothing to do with each other, so there is no replication to be checked
    return jax.jit(jax.shard_map(share, mesh=mesh, in_specs=spread, out_specs=spread, check_vma=False))


def _padded(part: Any, chunk: int) -> np.ndarray:
    """`part` filled up to `chunk` members by its last."""
    part = np.asarray(part)
    return np.concatenate([part, np.repeat(part[-1:], chunk - len(part), axis=0)])


def _placed(part: np.ndarray, mesh: Mesh) -> jax.Array:
    sharding = NamedSharding(mesh, PartitionSpec(mesh.axis_names))
    return jax.make_array_from_callback(part.shape, sharding, lambda index: part[index])


def _gathered(result: Any) -> Any:
    if jax.process_count() == 1:
        return result
    return multihost_utils.process_allgather(result, tiled=True)


class _Kept:
    """Finished chunks on disk, in a folder named after the members; a file a chunk and process."""

    def __init__(self, folder: Path, leaves: list, chunk: int):
        digest = hashlib.sha256(str(chunk).encode())
        for leaf in leaves:
            array = np.ascontiguousarray(leaf)
            digest.update(f"{array.shape}{array.dtype}".encode())
            digest.update(array.data)
        self.folder = folder / digest.hexdigest()[:16]
        self.folder.mkdir(parents=True, exist_ok=True)

    def _file(self, begin: int) -> Path:
        return self.folder / f"{begin}-{jax.process_index()}.npz"

    def load(self, begin: int) -> list[np.ndarray] | None:
        here = self._file(begin).exists()
        if jax.process_count() > 1:  # all or none: a chunk is computed together
            here = bool(np.all(multihost_utils.process_allgather(np.asarray(here))))
        if not here:
            return None
        with np.load(self._file(begin)) as stored:
            return [stored[name] for name in stored.files]

    def save(self, begin: int, part: list[np.ndarray]) -> None:
        unfinished = self._file(begin).with_suffix(".part.npz")
        np.savez(unfinished, *part)
        os.replace(unfinished, self._file(begin))
