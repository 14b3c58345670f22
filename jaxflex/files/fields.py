"""Read one table of a TOML file key by key, with an error that says file, key, found and allowed."""

from collections.abc import Callable
from typing import Any


class ArmFileError(ValueError):
    """An arm file that cannot be used; the message names file, key, what was found and what is allowed."""


class Fields:
    """One table of an arm file: hands out checked values, then refuses what is left over."""

    def __init__(self, table: Any, place: str, file: str):
        if not isinstance(table, dict):
            raise ArmFileError(f"{file}: {place}: found {table!r}, a table is needed.")
        self._table = dict(table)
        self._place = place
        self._file = file
        self._known: list[str] = []

    def fail(self, key: str, message: str) -> ArmFileError:
        """The error for `key`."""
        return ArmFileError(f"{self._file}: {self._place}{key}: {message}")

    def take(self, key: str, default: Any = None) -> Any:
        """The raw value of `key`, or `default`."""
        self._known.append(key)
        return self._table.pop(key, default)

    def has(self, key: str) -> bool:
        """True if `key` is given and not yet taken."""
        return key in self._table

    def number(
        self,
        key: str,
        default: float | None = None,
        allowed: str = "a positive number",
        accept: Callable[[float], bool] = lambda x: x > 0,
        required: bool = False,
    ) -> Any:
        """A finite number that `accept` takes; `allowed` says in words which."""
        value = self.take(key)
        if value is None:
            if required:
                raise self.fail(key, f"missing; {allowed} is needed.")
            return default
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.fail(key, f"found {value!r}; {allowed} is allowed.")
        if not abs(value) < float("inf") or not accept(value):
            raise self.fail(key, f"found {value!r}; {allowed} is allowed.")
        return float(value)

    def not_negative(self, key: str, default: float | None = 0.0) -> Any:
        """A number of at least zero."""
        return self.number(key, default, "a number of at least 0", lambda x: x >= 0)

    def whole(self, key: str, default: int, least: int) -> int:
        """A whole number of at least `least`."""
        value = self.take(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            raise self.fail(key, f"found {value!r}; a whole number of at least {least} is allowed.")
        return value

    def choice(self, key: str, default: str, allowed: "tuple[str, ...] | list[str]") -> str:
        """One of the words in `allowed`."""
        value = self.take(key, default)
        if value not in allowed:
            raise self.fail(key, f"found {value!r}; allowed are {', '.join(allowed)}.")
        return value

    def finish(self) -> None:
        """Refuse keys that nobody asked for."""
        for key in self._table:
            known = ", ".join(sorted(set(self._known)))
            raise self.fail(key, f"unknown key; allowed are {known}.")
