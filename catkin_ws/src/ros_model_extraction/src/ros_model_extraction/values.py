"""Parameters as Python has them (from the master, YAML, source code), in the terms of the metamodel."""

from __future__ import annotations

import base64
import datetime
import math
import sys
from collections.abc import Iterator, Mapping
from typing import Any

from ros_model.language.builder import MAX_NESTING
from ros_model.language.metamodel import ParameterType, Value

_MAX_NAMESPACES = 200
"""Levels of namespaces; what is below them counts as one value, for Python can't recurse without end."""


class UnwritableValueError(ValueError):
    """A value has no notation in the languages; the message says why."""


def leaves(tree: Mapping[str, Any], prefix: str = "", depth: int = 0) -> Iterator[tuple[str, Any]]:
    """Yield (name, value) of all parameters of a tree, names joined by slashes; empty namespaces hold none."""
    for key, value in sorted(tree.items(), key=lambda item: str(item[0])):
        name = f"{prefix}/{key}" if prefix else str(key)
        if isinstance(value, Mapping) and depth < _MAX_NAMESPACES:
            yield from leaves(value, name, depth + 1)
        else:
            yield name, value


def typed(raw: Any) -> tuple[ParameterType, Value]:
    """Return the declared type that fits a value, and the value as the metamodel has it.

    Raises:
        UnwritableValueError: the value, or one inside it, has no notation.
    """
    return _typed(raw, MAX_NESTING)


def _typed(raw: Any, left: int) -> tuple[ParameterType, Value]:
    """Return type and value, which may have so many braces within each other."""
    match raw:
        case bool() | int() | str():
            if isinstance(raw, int) and abs(raw) > sys.float_info.max:
                raise UnwritableValueError("it is too large for a double")
            return ParameterType(_PRIMITIVES[type(raw)]), raw
        case float():
            if not math.isfinite(raw):
                raise UnwritableValueError(f"{raw} is no finite number")
            return ParameterType("Double"), raw
        case bytes(data) | object(data=bytes(data)):  # the latter is a Binary of xmlrpc.client
            return ParameterType("Base64"), base64.b64encode(data).decode("ascii")
        case datetime.date() | object(value=str()):  # the latter is a DateTime of xmlrpc.client
            return ParameterType("Date"), str(raw)
        case list() | tuple():
            left = _without(left, 1)
            return _list([_typed(item, left) for item in raw])
        case dict() if raw:
            left = _without(left, 2)  # one around all members, one around each
            members = {str(name): _typed(item, left) for name, item in raw.items()}
            declared = tuple((name, kind) for name, (kind, _) in members.items())
            return ParameterType("Struct", members=declared), {name: value for name, (_, value) in members.items()}
    raise UnwritableValueError("a value of no kind that the language has" if raw is not None else "it has no value")


def _without(left: int, braces: int) -> int:
    if left < braces:
        raise UnwritableValueError(f"it is nested deeper than {MAX_NESTING} levels")
    return left - braces


_PRIMITIVES = {bool: "Boolean", int: "Integer", str: "String"}


def _list(items: list[tuple[ParameterType, Value]]) -> tuple[ParameterType, Value]:
    """Return the type of a list, which may be longer at another time or hold other things, such as a chain of filters.

    It says nothing of the members unless all are alike, or one needs its type to be written as what it is.
    """
    kinds = [kind for kind, _ in items]
    values = [value for _, value in items]
    if kinds and {kind.kind for kind in kinds} == {"Integer", "Double"}:
        return ParameterType("Array", (ParameterType("Double"),)), values
    if kinds and all(kind == kinds[0] for kind in kinds) and kinds[0].kind != "Struct":
        return ParameterType("Array", (kinds[0],)), values
    return ParameterType("List", tuple(kinds) if any(map(_needs_type, kinds)) else ()), values


def _needs_type(kind: ParameterType) -> bool:
    """Return whether a value of a type, or within it, is text in the language and something else in ROS."""
    inner = (*kind.elements, *(member for _, member in kind.members))
    return kind.kind in ("Base64", "Date") or any(map(_needs_type, inner))
