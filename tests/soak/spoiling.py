"""Makes wrong data of right ones: pure functions on messages of any type."""

from __future__ import annotations

import copy
import io
import math
import random
from typing import Any

import genpy
import roslib.message

WRONG_FRAME = "no/such frame"
SHIFT_S = 1000.0
"""By how much a stamp is wrong."""
AS_IT_IS = ("repeat", "flood")
"""Ways in which no message is wrong by itself, but how often it comes."""
_FLOATS = ("float32", "float64")
_USUAL = {"string": "text", "bool": True, "time": genpy.Time(2000), "duration": genpy.Duration(1)}


def can_spoil(message_class: Any, how: str) -> bool:
    """Tell whether messages of a type can be wrong in a way: it has a field for that."""
    right = example(message_class)
    return how in AS_IT_IS or differ(right, spoiled(right, how, random.Random(0)))


def differ(one: Any, other: Any) -> bool:
    """Tell whether two messages of one type differ, as they are sent."""
    return _sent(one) != _sent(other)


def _sent(message: Any) -> bytes:
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def spoiled(message: Any, how: str, draw: random.Random) -> Any:
    """Return a copy of a message that is wrong in one way, at every place where it can be.

    Args:
        message: a right one, of any type.
        how: one of `soak.plan.SPOILED`; `repeat` and `flood` are what it is, and wrong by how often they come.
        draw: for what is left open.
    """
    changed = copy.deepcopy(message)
    _spoil(changed, how, draw)
    return changed


def _spoil(message: Any, how: str, draw: random.Random) -> None:
    if not hasattr(message, "_slot_types"):  # a time or a duration
        return
    for name, kind in zip(message.__slots__, message._slot_types, strict=True):
        setattr(message, name, _value(getattr(message, name), kind, how, draw))
    if message._type == "std_msgs/Header" and how == "wrong frame":
        message.frame_id = WRONG_FRAME


def _value(value: Any, kind: str, how: str, draw: random.Random) -> Any:
    if kind.endswith("]"):
        return _array(value, kind, how, draw)
    if kind in _FLOATS:
        return {"nan": math.nan, "infinite": draw.choice((math.inf, -math.inf))}.get(how, value)
    if kind == "time":
        shift = {"future": SHIFT_S, "past": -SHIFT_S}.get(how, 0.0)
        return genpy.Time.from_sec(max(0.0, value.to_sec() + shift)) if shift else value
    if kind == "string" and how in ("empty", "wrong size"):
        return "" if how == "empty" else "x" * 100_000
    if "/" in kind or kind == "Header":
        _spoil(value, how, draw)
    return value


def _array(value: Any, kind: str, how: str, draw: random.Random) -> Any:
    element, _, size = kind.rpartition("[")
    if size == "]" and how == "empty":
        return type(value)()
    if size == "]" and how == "wrong size":
        return value[: len(value) // 2]
    if element in _FLOATS:
        wrong = _value(0.0, element, how, draw)
        return [wrong] * len(value) if wrong != 0.0 else value
    for one in value:
        if "/" in element:
            _spoil(one, how, draw)
    return value


def example(message_class: Any) -> Any:
    """Return a message of a type with a value in each field, and with one element in each of its arrays."""
    message = message_class()
    for name, kind in zip(message.__slots__, message._slot_types, strict=True):
        element, _, size = kind.rpartition("[")
        if size == "]":
            setattr(message, name, bytes(1) if element in ("uint8", "char") else [_example_of(element)])
        elif not element:
            setattr(message, name, _example_of(kind))
    return message


def _example_of(kind: str) -> Any:
    if "/" in kind or kind == "Header":
        return example(roslib.message.get_message_class("std_msgs/Header" if kind == "Header" else kind))
    return _USUAL.get(kind, 1.0 if kind in _FLOATS else 1)
