"""Checked access to a parameter tree; what is wrong is named with its path and its value."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any


class ParameterError(ValueError):
    """A parameter is missing, of the wrong type or out of its range; the message names it."""


class ParameterTree:
    """One level of the tree."""

    def __init__(self, tree: Any, prefix: str) -> None:
        if not hasattr(tree, "get"):
            raise ParameterError(f"~{prefix or ''}: must be a group of parameters, is {tree!r}")
        self._tree: Mapping[str, Any] = tree
        self._prefix = prefix

    def child(self, name: str) -> ParameterTree:
        """Return the level below; it is empty where there is none."""
        return ParameterTree(self._tree.get(name, {}), self.path(name))

    def path(self, name: str) -> str:
        """Return a parameter's name from the top."""
        return f"{self._prefix}/{name}" if self._prefix else name

    def has(self, name: str) -> bool:
        """Whether it is given."""
        return name in self._tree

    def error(self, name: str, rule: str, value: object) -> ParameterError:
        """Return the error for a value that breaks a rule."""
        return ParameterError(f"~{self.path(name)}: {rule}, is {value!r}; correct the launch or YAML file that sets it")

    def value(self, name: str, default: object) -> Any:
        """Return a value as it is given, unchecked."""
        return self._tree.get(name, default)

    def number(
        self,
        name: str,
        default: float,
        *,
        low: float = -math.inf,
        high: float = math.inf,
        above: bool = False,
        formerly: str = "",
    ) -> float:
        """Return a number within bounds; `formerly` is its name in older files."""
        if formerly and not self.has(name) and self.has(formerly):
            name = formerly
        value = self.value(name, default)
        if isinstance(value, bool) or not isinstance(value, int | float) or math.isnan(value):
            raise self.error(name, "must be a number", value)
        if name in self._tree and math.isinf(value):
            raise self.error(name, "must be finite", value)
        if value < low or value > high or (above and value == low):
            bounds = f"{'over' if above else 'at least'} {low:g}" if math.isfinite(low) else ""
            upper = f"at most {high:g}" if math.isfinite(high) else ""
            raise self.error(name, f"must be {' and '.join(part for part in (bounds, upper) if part)}", value)
        return float(value)

    def integer(self, name: str, default: int, *, low: int, high: int) -> int:
        """Return a whole number within bounds; 3.0 is one."""
        value = self.number(name, default, low=low, high=high)
        if value != int(value):
            raise self.error(name, "must be a whole number", value)
        return int(value)

    def boolean(self, name: str, default: bool) -> bool:
        """Return a boolean; 1 and "yes" are refused."""
        value = self.value(name, default)
        if not isinstance(value, bool):
            raise self.error(name, "must be true or false", value)
        return value

    def text(self, name: str, default: str) -> str:
        """Return a text."""
        value = self.value(name, default)
        if not isinstance(value, str):
            raise self.error(name, "must be a text", value)
        return value

    def frame(self, name: str, default: str) -> str:
        """Return a frame's name without a leading slash: tf2 refuses it, and published files have it."""
        return self.text(name, default).removeprefix("/")

    def sequence(self, name: str, default: tuple[object, ...]) -> tuple[Any, ...]:
        """Return a list of anything."""
        value = self.value(name, default)
        if not isinstance(value, list | tuple):
            raise self.error(name, "must be a list", value)
        return tuple(value)

    def plugin(self, where: str, entry: Any, types: Mapping[str, str]) -> tuple[str, str]:
        """Return name and kind of an entry `{name, type}` of a list of plug-ins."""
        if not isinstance(entry, dict) or not isinstance(entry.get("name"), str) or not entry["name"]:
            raise self.error(where, "must have a name and a type", entry)
        kind = types.get(str(entry.get("type")))
        if kind is None:
            raise self.error(where, f"unknown type; known are {', '.join(types)}", entry.get("type"))
        return entry["name"], kind

    def numbers(self, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """Return finite numbers, given as a list or as a text."""
        given = self.value(name, default)
        if isinstance(given, str):  # base_local_planner's own form of a list
            given = given.strip("[] ").replace(",", " ").split()
        elif not isinstance(given, list | tuple) or any(isinstance(v, bool | str) for v in given):
            raise self.error(name, "must be a list of numbers", given)
        try:
            values = tuple(float(value) for value in given)
        except (TypeError, ValueError) as error:
            raise self.error(name, "must be a list of numbers", given) from error
        if not all(math.isfinite(value) for value in values):
            raise self.error(name, "must be a list of finite numbers", given)
        return values
