"""A design beside its arm in one TOML file: what `tune` writes and `simulate` loads."""

from pathlib import Path
from typing import Any

import jax.numpy as jnp

from controllers import GAINS, PD, Design, Move, Shaper

from ..arm.arm import Arm
from ..files.arm_file import ArmFile, save_arm
from ..files.fields import Fields


def save_design(path: Path, arm: Arm, uncertainty: dict[str, float], design: Design) -> None:
    """Write arm and design to `path`."""
    table: dict[str, Any] = {name: list(getattr(design.controller, name)) for name in GAINS}
    table["start"] = list(design.move.start)
    table["stop"] = list(design.move.stop)
    table["duration"] = float(design.move.duration)
    table["amplitudes"] = design.shaper.amplitudes.tolist()
    table["delays"] = design.shaper.delays.tolist()
    save_arm(arm, path, uncertainty, table)


def read_design(file: ArmFile, name: str) -> Design | None:
    """The design in an arm file, or None; `name` names the file in errors."""
    if file.design is None:
        return None
    fields = Fields(file.design, "design: ", name)
    joints = len(file.arm.joints)

    def numbers(key: str, count: int | None) -> list[float]:
        value = fields.take(key)
        good = isinstance(value, list) and all(
            isinstance(v, (int, float)) and not isinstance(v, bool) for v in value
        )
        if not good or (count is not None and len(value) != count) or not value:
            wanted = "numbers" if count is None else f"{count} number(s)"
            raise fields.fail(key, f"found {value!r}; a list of {wanted} is needed.")
        return [float(v) for v in value]

    gains = [tuple(numbers(key, joints)) for key in GAINS]
    start, stop = numbers("start", joints), numbers("stop", joints)
    duration = fields.number("duration", required=True)
    amplitudes = numbers("amplitudes", None)
    delays = numbers("delays", len(amplitudes))
    fields.finish()
    move = Move(tuple(start), tuple(stop), duration)
    return Design(PD(*gains), move, Shaper(jnp.asarray(amplitudes), jnp.asarray(delays)))
