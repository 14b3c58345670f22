"""What every command does first: precision, compilation cache, and clear errors."""

from collections.abc import Callable
from functools import wraps
from pathlib import Path

import typer
from rich.console import Console

from ..files.fields import ArmFileError
from ..files.recording import RecordingError
from ..session import set_up
from ..simulation.trajectory import SimulationError

WIDTH = 112  # columns that the widest table needs; a narrower terminal wraps

console = Console(highlight=False, width=max(WIDTH, Console().width))
errors = Console(stderr=True, highlight=False)


class UsageError(ValueError):
    """Bad input from the command line; the message says what is allowed."""


def command(function: Callable, fuse: bool = False) -> Callable:
    """A command that prepares JAX (`fuse`: see `set_up`) and turns bad input into one line and exit status 2."""

    @wraps(function)
    def run(*args, **kwargs):
        set_up(fuse=fuse)
        try:
            return function(*args, **kwargs)
        except (ArmFileError, RecordingError, UsageError, SimulationError) as error:
            errors.print(f"jaxflex: {error}", style="bold red", markup=False, soft_wrap=True)
            raise typer.Exit(2) from error

    return run


def parse_payloads(text: str) -> list[float]:
    """Payloads [kg] from `first:last:count`, or numbers with commas between.

    **Raises** `UsageError` for anything else.
    """
    try:
        if ":" in text:
            first, last, count = text.split(":")
            low, high, n = float(first), float(last), int(count)
            if n < 1 or (n == 1 and low != high):
                raise ValueError
            values = [low + (high - low) * i / max(n - 1, 1) for i in range(n)]
        else:
            values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if not values or any(not 0 <= v < 1e6 for v in values) or values != sorted(set(values)):
        raise UsageError(
            f"--payloads {text!r}: allowed are FIRST:LAST:COUNT in kg, such as 0:0.1:6, or rising "
            "numbers with commas between, none below 0."
        )
    return values


def parse_numbers(text: str, option: str, count: int) -> list[float]:
    """`count` numbers with commas between; raises `UsageError` for anything else."""
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) != count:
        raise UsageError(f"{option} {text!r}: {count} number(s) with commas between are needed.")
    return values


def make_folder(output: Path | None) -> Path:
    """The folder for results, made if need be; raises `UsageError` if it cannot be."""
    folder = output or Path("jaxflex-results")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"-o {folder}: cannot be made: {error.strerror}.") from error
    return folder
