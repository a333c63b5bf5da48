"""Checks of parameter values. Each kind of value has one definition for all nodes.

The functions check one value. `ParameterTree` checks values of a mapping, as the parameter server, a launch file or a
bag holds it, by their names. A value that can't be used raises a ParameterError with the full name, the value and the
remedy.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from node_kit.one_line import OneLineError

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

PRIVATE = "~"
"""Stands for the node's name in names of parameters."""

_REMEDY = "correct the launch or YAML file that sets it"
_TRUE, _FALSE = (True, 1, "true", "True"), (False, 0, "false", "False")


class ParameterError(OneLineError, ValueError):
    """A parameter can't be used; one line with its full name, its value and the remedy."""


def misfit(value: object, name: str, rule: str) -> ParameterError:
    """Return the error of a value that breaks a rule, such as `must be 0 or more`."""
    return ParameterError(f"parameter {name} is {value!r}: it {rule}: {_REMEDY}")


def number(value: object, name: str, low: float = -math.inf, high: float = math.inf, above: bool = False) -> float:
    """Return a finite number.

    Args:
        value: an integer or a float. A Boolean is no number.
        name: full name of the parameter.
        low: its least value.
        high: its greatest value.
        above: it has to be more than `low`.

    Raises:
        ParameterError: it is none, or out of its range.
    """
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    if not is_number or not low <= value <= high or (above and value == low):  # type: ignore[operator]
        raise misfit(value, name, f"must be a finite number{_range(low, high, above)}")
    return float(value)  # type: ignore[arg-type]


def whole(value: object, name: str, low: float = -math.inf, high: float = math.inf) -> int:
    """Return a whole number within its range; 3.0 is one.

    Raises:
        ParameterError: it is none, or out of its range.
    """
    is_whole = isinstance(value, int) or (isinstance(value, float) and value.is_integer())
    if isinstance(value, bool) or not is_whole or not low <= value <= high:  # type: ignore[operator]
        raise misfit(value, name, f"must be a whole number{_range(low, high)}")
    return int(value)  # type: ignore[call-overload]


def flag(value: object, name: str) -> bool:
    """Return a Boolean: true or false, as a text too, or 1 or 0.

    Raises:
        ParameterError: it is none.
    """
    if value in _TRUE:
        return True
    if value in _FALSE:
        return False
    raise misfit(value, name, "must be true or false")


def text(value: object, name: str) -> str:
    """Return a text; no value is the empty text. A number becomes its digits, because YAML reads some names as numbers.

    Raises:
        ParameterError: it is none.
    """
    if value is None:
        return ""
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise misfit(value, name, "must be a text")
    return str(value)


def choice(value: object, name: str, choices: Sequence[str]) -> str:
    """Return one of several texts.

    Raises:
        ParameterError: it is none of them.
    """
    if not isinstance(value, str) or value not in choices:
        raise misfit(value, name, f"must be one of {', '.join(choices)}")
    return value


def named_entries(tree: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield (name, entry) of a mapping whose names are those of the graph, such as `arm/driver: {node: arm/driver}`.

    The parameter server reads the slashes in a name as levels of a tree. So mappings in an entry are entries whose
    names go on with a slash; what else an entry has is its own.

    Args:
        tree: the mapping, as the file or as the parameter server has it.
        above: what all names begin with.
    """
    for key, value in tree.items():
        name = f"{above}/{key}" if above else str(key)
        if not isinstance(value, Mapping):
            yield name, value
            continue
        own = {k: v for k, v in value.items() if not isinstance(v, Mapping)}
        below = {k: v for k, v in value.items() if isinstance(v, Mapping)}
        if own or not below:
            yield name, own
        yield from named_entries(below, name)


def path(value: object, name: str) -> Path:
    """Return the path of a file; `~` is the home folder.

    Raises:
        ParameterError: it is no text, is empty, or can be no path.
    """
    if not isinstance(value, str) or not value or "\0" in value:
        raise misfit(value, name, "must be the path of a file")
    try:
        return Path(value).expanduser()
    except RuntimeError as error:  # there is no such user
        raise misfit(value, name, "must be the path of a file") from error


def items(value: object, name: str) -> list[Any]:
    """Return a list of anything.

    Raises:
        ParameterError: it is none.
    """
    if not isinstance(value, (list, tuple)):
        raise misfit(value, name, "must be a list")
    return list(value)


def texts(value: object, name: str) -> list[str]:
    """Return a list of texts; a text is the list of its parts between commas.

    A text may have brackets and quotes, too, as in `tomasys:="[a.owl, 'b.owl']"`: roslaunch passes lists in arguments
    on as texts.

    Raises:
        ParameterError: it is neither.
    """
    if isinstance(value, str):
        inner = value.strip()
        if inner.startswith("[") and inner.endswith("]"):
            inner = inner[1:-1]
        parts = (part.strip().strip("'\"").strip() for part in inner.split(","))
        return [part for part in parts if part]
    if not isinstance(value, (list, tuple)) or not all(isinstance(item, str) for item in value):
        raise misfit(value, name, "must be a list of texts")
    return list(value)


def numbers(value: object, name: str) -> list[float]:
    """Return a list of finite numbers. A text such as `[0.1, 0.3]` is a list, too, as in base_local_planner.

    Raises:
        ParameterError: it is neither.
    """
    rule = "must be a list of finite numbers"
    if isinstance(value, str):
        try:
            found = [float(part) for part in value.strip("[] ").replace(",", " ").split()]
        except ValueError as error:
            raise misfit(value, name, rule) from error
    elif isinstance(value, (list, tuple)) and not any(isinstance(item, (bool, str)) for item in value):
        found = [item if isinstance(item, (int, float)) else math.nan for item in value]
    else:
        raise misfit(value, name, rule)
    if not all(math.isfinite(item) for item in found):
        raise misfit(value, name, rule)
    return [float(item) for item in found]


def mapping(value: object, name: str, content: str = "") -> Mapping[str, Any]:
    """Return a mapping; nothing, such as the empty text, is an empty one.

    Args:
        value: the mapping.
        name: full name of the parameter.
        content: what it maps, for the error, such as `objective -> action`.

    Raises:
        ParameterError: it is none.
    """
    if not value:
        return {}
    if not isinstance(value, Mapping):
        raise misfit(value, name, f"must be a mapping {content}".rstrip())
    return value


def unknown(name: str, known: Collection[str]) -> str:
    """Return what to say of a name that is not known: the one that it may stand for, else all."""
    meant = difflib.get_close_matches(name, known, n=1)
    return f"did you mean {meant[0]}?" if meant else f"known are {', '.join(sorted(known))}"


class ParameterTree:
    """One level of a tree of parameters. Defaults are checked like given values, but may be infinite."""

    def __init__(self, values: object, place: str = PRIVATE) -> None:
        """Take the values.

        Args:
            values: parameters by name; a level below is a mapping.
            place: name of the level, to which names are relative: that of the node, or `~`.

        Raises:
            ParameterError: the values are no mapping.
        """
        self._place = place
        if not isinstance(values, Mapping):
            raise misfit(values, place, "must be a group of parameters")
        self.values: Mapping[str, Any] = values

    def full_name(self, name: str) -> str:
        """Return the full name of a parameter of this level."""
        return f"{self._place}{'' if self._place.endswith((PRIVATE, '/')) else '/'}{name}"

    def child(self, name: str) -> ParameterTree:
        """Return the level below; empty where there is none."""
        return ParameterTree(self.values.get(name, {}), self.full_name(name))

    def strangers(self, known: Collection[str], beginnings: tuple[str, ...] = ()) -> list[str]:
        """Return what to say of each parameter of this level that nobody reads, as where its name is misspelt.

        Args:
            known: names of those that are read.
            beginnings: of names of which any number may be given.
        """
        return [
            f"parameter {self.full_name(name)} is left out, because nothing reads it: {unknown(name, known)}"
            for name in sorted(map(str, self.values))  # of a YAML file, they may be numbers
            if name not in known and not name.startswith(beginnings)
        ]

    def has(self, name: str) -> bool:
        """Return whether a parameter is given."""
        return name in self.values

    def error(self, name: str, rule: str, value: object) -> ParameterError:
        """Return the error of a value that breaks a rule, such as `must be 0 or more`."""
        return misfit(value, self.full_name(name), rule)

    def value(self, name: str, default: object = None) -> Any:
        """Return whatever is given, unchecked."""
        return self.values.get(name, default)

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
        """Return a number within its range; `formerly` is its name in older files."""
        if formerly and not self.has(name) and self.has(formerly):
            name = formerly
        if not self.has(name) and math.isinf(default):
            return default
        return number(self.values.get(name, default), self.full_name(name), low, high, above)

    def whole(self, name: str, default: int, *, low: float = -math.inf, high: float = math.inf) -> int:
        """Return a whole number within its range."""
        return whole(self.values.get(name, default), self.full_name(name), low, high)

    def flag(self, name: str, default: bool) -> bool:
        """Return a Boolean."""
        return flag(self.values.get(name, default), self.full_name(name))

    def text(self, name: str, default: str = "") -> str:
        """Return a text."""
        return text(self.values.get(name, default), self.full_name(name))

    def choice(self, name: str, default: str, choices: Sequence[str]) -> str:
        """Return one of several texts."""
        return choice(self.values.get(name, default), self.full_name(name), choices)

    def path(self, name: str, default: str = "") -> Path:
        """Return the path of a file."""
        return path(self.values.get(name, default), self.full_name(name))

    def items(self, name: str, default: Sequence[Any] = ()) -> list[Any]:
        """Return a list of anything."""
        return items(self.values.get(name, default), self.full_name(name))

    def texts(self, name: str, default: Sequence[str] = ()) -> list[str]:
        """Return a list of texts."""
        return texts(self.values.get(name, default), self.full_name(name))

    def numbers(self, name: str, default: Sequence[float] = ()) -> list[float]:
        """Return a list of finite numbers."""
        return numbers(self.values.get(name, default), self.full_name(name))

    def mapping(self, name: str, content: str = "") -> Mapping[str, Any]:
        """Return a mapping, empty where it is not given."""
        return mapping(self.values.get(name), self.full_name(name), content)


def _range(low: float, high: float, above: bool = False) -> str:
    limits = [f"{'more than' if above else 'at least'} {low:g}"] * math.isfinite(low)
    limits += [f"at most {high:g}"] * math.isfinite(high)
    return f", {' and '.join(limits)}" if limits else ""
