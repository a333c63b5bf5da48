"""Makes wrong data of right ones: pure functions on messages of any type."""

from __future__ import annotations

import copy
import math
import random
from typing import Any

import genpy
import roslib.message

WRONG_FRAME = "no/such frame"
SHIFT_S = 1000.0
"""By how much a stamp is wrong."""
_FLOATS = ("float32", "float64")


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
    if message._type == "std_msgs/Header":
        _spoil_header(message, how)


def _spoil_header(header: Any, how: str) -> None:
    if how == "wrong frame":
        header.frame_id = WRONG_FRAME
    shift = {"future": SHIFT_S, "past": -SHIFT_S}.get(how)
    if shift is not None:
        header.stamp = genpy.Time.from_sec(max(0.0, header.stamp.to_sec() + shift))


def _value(value: Any, kind: str, how: str, draw: random.Random) -> Any:
    if kind.endswith("]"):
        return _array(value, kind, how, draw)
    if kind in _FLOATS:
        return {"nan": math.nan, "infinite": draw.choice((math.inf, -math.inf))}.get(how, value)
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
    """Return a message of a type with one element in each of its arrays."""
    message = message_class()
    for name, kind in zip(message.__slots__, message._slot_types, strict=True):
        value = getattr(message, name)
        if kind.endswith("[]"):
            element = kind[:-2]
            if element in _FLOATS:
                setattr(message, name, [1.0])
            elif "/" in element:
                found = roslib.message.get_message_class(element)
                setattr(message, name, [example(found)] if found else [])
        elif hasattr(value, "_slot_types") and value.__slots__:
            setattr(message, name, example(type(value)))
    return message
