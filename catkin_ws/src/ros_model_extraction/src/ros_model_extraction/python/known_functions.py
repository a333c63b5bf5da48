"""Functions and methods outside the sources whose results are known: of Python itself, and of rospy."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ros_model_extraction.python.values import (
    Const,
    External,
    Items,
    Table,
    Text,
    Unknown,
    Value,
    joined,
    text_of,
    weight,
)

OWN_NAME = "~"
"""Stands for the node's own name: what follows it is private."""

_ROS = ("rospy.", "rosgraph.")
_MESSAGES = ("numpy_msg", "get_message_class", "get_service_class")
_CONVERSIONS: dict[str, Any] = {"str": str, "int": int, "float": float, "bool": bool, "range": range}
_MAX_RANGE = 64
_MAX_WORK = 1_000_000  # characters of a text times those of what is put into it
_WIDE = re.compile(r"%[^%a-zA-Z]*(?:\d{4}|\*)|\{[^{}:]*:[^{}]*(?:\d{4}|\{)")  # fields of a width over 999, or any
_JOINS = {"os.path.join", "posixpath.join", "rosgraph.names.ns_join"}
_SAME_ITEMS = {"list", "tuple", "set", "frozenset", "iter", "reversed", "sorted"}
_SAME_NAME = {"resolve_name", "remap_name", "canonicalize_name"}
_TEXT_METHODS = {
    "capitalize",
    "format",
    "lower",
    "lstrip",
    "removeprefix",
    "removesuffix",
    "replace",
    "rstrip",
    "strip",
    "title",
    "upper",
}


def value_of(raw: Any) -> Value:
    """Return a plain Python value, e.g. of a parameter, as a Value."""
    if isinstance(raw, Mapping):
        return Table(tuple((Const(key), value_of(item)) for key, item in raw.items()))
    if isinstance(raw, (list, tuple)):
        return Items(tuple(value_of(item) for item in raw))
    return Const(raw) if isinstance(raw, (str, int, float, bool, bytes)) or raw is None else Unknown(repr(raw))


def plain(value: Value | None) -> Any:
    """Return a Value as plain Python has it.

    Raises:
        ValueError: a part of it is not known, or no plain value.
    """
    match value:
        case Const(raw):
            return raw
        case Items(values):
            return [plain(item) for item in values]
        case Table(items) if all(isinstance(key, Const) for key, _ in items):
            return {plain(key): plain(item) for key, item in items}
    raise ValueError("not known")


def is_costly(text: str, arguments: Iterable[Value]) -> bool:
    """Return whether a filled-in pattern, or a text's method, might give a huge text: by wide fields, by repetition."""
    return _WIDE.search(text) is not None or len(text) * max(map(weight, arguments), default=1) > _MAX_WORK


def knows(name: str) -> bool:
    """Return whether `call_function` may have an answer for a function."""
    package, _, function = name.rpartition(".")
    return package in ("builtins", "os.path", "posixpath") or name.startswith(_ROS) or function in _MESSAGES


def call_function(name: str, arguments: Sequence[Value]) -> Value | None:
    """Return what an outside function returns, or None where that is not known."""
    package, _, function = name.rpartition(".")
    first = arguments[0] if arguments else None
    if function == "numpy_msg" and first is not None:
        return first
    if package == "builtins":
        return _builtin(function, arguments)
    if name in _JOINS and arguments and all(map(_is_text, arguments)):
        return Const(posixpath.join(*(argument.value for argument in arguments if isinstance(argument, Const))))
    if function in _MESSAGES and isinstance(first, Const):
        message_package, _, message = str(first.value).partition("/")
        return External(f"{message_package}.{'msg' if 'message' in function else 'srv'}.{message}")
    return _rospy(function, first) if name.startswith(_ROS) else None


def call_method(value: Value, method: str, arguments: Sequence[Value]) -> Value | None:
    """Return what a method of a text, list or dict returns, or None where that is not known."""
    match value:
        case Const(str(text)) if not is_costly(text, arguments):
            return _text_method(text, method, arguments)
        case Table(items):
            return _table_method(items, method, arguments)
    return None


def elements(value: Value) -> tuple[Value, ...] | None:
    """Return what iterating over a value gives, or None where that is not known."""
    match value:
        case Items(values):
            return values
        case Table(items):
            return tuple(key for key, _ in items)
        case Const(str(text)):
            return tuple(Const(character) for character in text)
    return None


def _builtin(function: str, arguments: Sequence[Value]) -> Value | None:
    if function in _CONVERSIONS:
        return _converted(function, arguments)
    lists = [elements(argument) for argument in arguments]
    known = [items for items in lists if items is not None]
    found: Value | None = None
    if not arguments:
        found = Items(()) if function in _SAME_ITEMS else None
    elif len(known) < len(lists):
        found = None
    elif function in _SAME_ITEMS:
        found = Items(tuple(reversed(known[0])) if function == "reversed" else known[0])
    elif function == "enumerate":
        found = Items(tuple(Items((Const(number), item)) for number, item in enumerate(known[0])))
    elif function == "zip":
        found = Items(tuple(Items(group) for group in zip(*known, strict=False)))
    elif function == "dict" and isinstance(arguments[0], Table):
        found = arguments[0]
    return found


def _converted(function: str, arguments: Sequence[Value]) -> Value | None:
    """Return a number, text or range that is made of known ones."""
    if function == "str" and len(arguments) == 1 and not isinstance(arguments[0], Unknown):
        text = text_of(arguments[0])
        return joined([text]) if text else None
    constants = [argument.value for argument in arguments if isinstance(argument, Const)]
    if not constants or len(constants) < len(arguments):
        return None
    try:
        if function == "range":
            numbers = range(*constants)
            return Items(tuple(map(Const, numbers))) if len(numbers) <= _MAX_RANGE else None
        return Const(_CONVERSIONS[function](*constants))
    except (ArithmeticError, LookupError, ValueError, TypeError):  # a lookup: of an encoding
        return None


def _rospy(function: str, first: Value | None) -> Value | None:
    if function == "get_name":
        return Const(OWN_NAME)
    if function == "get_namespace":
        return Const("")
    return first if function in _SAME_NAME else None


def _text_method(text: str, method: str, arguments: Sequence[Value]) -> Value | None:
    if method == "join" and arguments and (items := elements(arguments[0])) is not None:
        texts = [text_of(item) for item in items]
        known = [part for part in texts if part]
        if len(known) < len(texts):
            return None
        separated = [part for item in known for part in (Text((text,)), item)][1:]
        return joined(separated)
    if method == "split" and len(arguments) <= 1 and all(map(_is_text, arguments)) and Const("") not in arguments:
        separators = [argument.value for argument in arguments if isinstance(argument, Const)]
        return Items(tuple(map(Const, text.split(*separators))))
    if method not in _TEXT_METHODS or not all(isinstance(argument, Const) for argument in arguments):
        return None
    try:
        return Const(getattr(text, method)(*(a.value for a in arguments if isinstance(a, Const))))
    except (ArithmeticError, TypeError, ValueError, LookupError, AttributeError):
        return None


def _table_method(items: tuple[tuple[Value, Value], ...], method: str, arguments: Sequence[Value]) -> Value | None:
    if method == "items":
        return Items(tuple(Items(item) for item in items))
    if method == "values":
        return Items(tuple(value for _, value in items))
    if method == "keys":
        return Items(tuple(key for key, _ in items))
    if method == "get" and arguments and isinstance(arguments[0], Const):
        default: Value = arguments[1] if len(arguments) > 1 else Const(None)
        return next((value for key, value in items if key == arguments[0]), default)
    return None


def _is_text(value: Value) -> bool:
    return isinstance(value, Const) and isinstance(value.value, str)
