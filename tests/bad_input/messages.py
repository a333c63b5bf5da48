"""Messages with hostile values in their fields, and in bytes as they come over a connection."""

from __future__ import annotations

import io
import struct
from functools import cache
from typing import TYPE_CHECKING, Any

import genpy
import roslib.message
from genpy.base import is_simple

from bad_input import hostile
from bad_input.mutation import LARGEST, mutated

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from random import Random

_INTEGERS = {
    **{f"int{bits}": (-(1 << (bits - 1)), (1 << (bits - 1)) - 1) for bits in (8, 16, 32, 64)},
    **{f"uint{bits}": (0, (1 << bits) - 1) for bits in (8, 16, 32, 64)},
    "byte": (-128, 127),
    "char": (0, 255),
}
_HEADER = struct.Struct("<BI")
_BY_BYTES = 0.25
_MOST_ITEMS = 1_000_000
"""Of a list that is made longer, so that the list of a list that was made longer before takes no gigabytes."""
_TIMES = 20
"""How much too large a message may be before it is not even made, by a guess that gives its lists equal shares."""


def serialised(message: Any) -> bytes:
    """Return a message as it goes over a connection."""
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def pack(parts: Sequence[tuple[int, bytes]]) -> bytes:
    """Return messages, each with the number of its topic, as one input."""
    return b"".join(_HEADER.pack(topic, len(data)) + data for topic, data in parts)


def unpack(data: bytes) -> list[tuple[int, bytes]]:
    """Return the messages of an input."""
    parts, place = [], 0
    while place + _HEADER.size <= len(data):
        topic, size = _HEADER.unpack_from(data, place)
        place += _HEADER.size
        parts.append((topic, data[place : place + size]))
        place += size
    return parts


def changed(rng: Random, data: bytes, kind: Any, others: Sequence[bytes]) -> bytes:
    """Return the bytes of a message that was changed in its fields, or in its bytes.

    Args:
        rng: the only source of chance.
        data: of a message.
        kind: its class.
        others: messages on the same topic.
    """
    if rng.random() < _BY_BYTES:
        return mutated(rng, [data, *others], "binary")
    message = kind()
    try:
        message.deserialize(data)
    except (genpy.DeserializationError, UnicodeDecodeError):
        return mutated(rng, [data], "binary")
    if not message.__slots__:  # the request of a trigger
        return mutated(rng, [data, *others], "binary")
    last = data  # where nothing can be changed: what is read from it may not fit into a message, such as a late stamp
    for _ in range(rng.choice((1, 1, 1, 2, 3, 6))):
        holder, slot, type_name = rng.choice(list(_fields(message)))
        before, wrong = getattr(holder, slot), _bad(rng, type_name, getattr(holder, slot))
        if isinstance(wrong, list) and len(wrong) * len(last) > _TIMES * LARGEST * max(1, len(before)):
            continue  # it takes minutes to make, and is too large in the end
        setattr(holder, slot, wrong)
        try:
            result = serialised(message)
        except (genpy.SerializationError, struct.error, ValueError, TypeError, AttributeError, OverflowError):
            setattr(holder, slot, before)
            continue
        if len(result) > LARGEST:
            setattr(holder, slot, before)
        else:
            last = result
    return last


def _fields(message: Any) -> Iterator[tuple[Any, str, str]]:
    for slot, type_name in zip(message.__slots__, message._slot_types, strict=True):
        yield message, slot, type_name
        value = getattr(message, slot)
        if isinstance(value, genpy.Message):
            yield from _fields(value)
        elif isinstance(value, list):
            for item in value[:5]:
                if isinstance(item, genpy.Message):
                    yield from _fields(item)


def _bad(rng: Random, type_name: str, value: Any) -> Any:  # noqa: PLR0911
    if type_name.endswith("]"):
        return _bad_array(rng, type_name, value)
    if type_name in _INTEGERS:
        low, high = _INTEGERS[type_name]
        return rng.choice((low, high, 0, 1, high // 2, rng.randint(low, high), min(high, max(low, value + 1))))
    if type_name.startswith("float"):
        return rng.choice(
            [n for n in hostile.NUMBERS if isinstance(n, float)] + [-value, value * 1e6, value + 1e-9, 0.0]
        )
    if type_name == "bool":
        return not value
    if type_name == "string":
        return rng.choice((*hostile.TEXTS, value * 50, value[: len(value) // 2], value + "\0", f"/{value}/"))
    if type_name in ("time", "duration"):
        whole, part = rng.choice((0, 1, 2**31 - 1, 2**32 - 1, -1, -(2**31))), rng.choice((0, 1, 999_999_999, 2**31 - 1))
        return (
            genpy.Time(max(whole, 0), part % 10**9) if type_name == "time" else genpy.Duration(min(whole, 2**31 - 1), 0)
        )
    return type(value)()


def _bad_array(rng: Random, type_name: str, value: Any) -> Any:  # noqa: PLR0911
    inner, _, size = type_name.rstrip("]").partition("[")
    if isinstance(value, bytes):
        inside = mutated(rng, [value], "binary")
        return rng.choice((b"", value[:-1], value + b"\0", value * 2, b"\xff" * len(value), bytes(70_000), inside))
    items = list(value)
    if size:
        place = rng.randrange(len(items))
        items[place] = _bad(rng, inner, items[place])
        return items if rng.random() < 0.8 else [items[place]] * len(items)
    example = items[0] if items else _made(inner)
    match rng.randrange(7):
        case 0:
            return []
        case 1:
            return items[:-1]
        case 2:
            return [*items, example]
        case 3:
            longer = (items or [example])[:_MOST_ITEMS]
            return longer * min(rng.choice((2, 50, 3000)), max(2, _MOST_ITEMS // len(longer)))
        case 4:
            return items[::-1]
        case 5 if items:
            return [_bad(rng, inner, items[0])] * len(items)
    if not items:
        return [_bad(rng, inner, example)]
    items[rng.randrange(len(items))] = _bad(rng, inner, example)
    return items


@cache
def _kind(type_name: str) -> Any:
    return roslib.message.get_message_class(type_name)


def _made(type_name: str) -> Any:
    """Return an empty value of a type."""
    if type_name in _INTEGERS:
        return 0
    if is_simple(type_name):
        return {"string": "", "bool": False}.get(type_name, 0.0)
    if type_name in ("time", "duration"):
        return genpy.Time() if type_name == "time" else genpy.Duration()
    if type_name == "string":
        return ""
    return _kind("std_msgs/Header" if type_name == "Header" else type_name)()
