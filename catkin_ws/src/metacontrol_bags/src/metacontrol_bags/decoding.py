"""Decodes the messages of a bag by the definitions in it, and tells which ones cannot be decoded."""

from __future__ import annotations

import struct
from collections import Counter
from typing import TYPE_CHECKING, Any

from rosbags.serde import SerdeError
from rosbags.typesys import TypesysError

from metacontrol_bags.printable import printable
from metacontrol_bags.typestore import types_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from metacontrol_bags.bag_file import BagFile, Connection

_ERRORS = (SerdeError, ValueError, AttributeError, AssertionError, LookupError, TypeError, OverflowError, struct.error)
"""What messages raise that do not fit their definition, or are of another type than their topic usually has."""


def decode(
    bag: BagFile,
    wanted: Callable[[Connection], bool],
    take: Callable[[Connection, int, Any], None],
    is_due: Callable[[Connection, int], bool] = lambda _connection, _stamp: True,
) -> tuple[str, ...]:
    """Pass on the wanted messages of a bag, in the order of the file, and return which ones are lost, in words.

    Args:
        bag: it is read to its end.
        wanted: tells which connections are.
        take: gets the connection, the time of recording in ns and the message. If it raises LookupError, ValueError or
            the like, the message is lost: it is of another type than its topic usually has.
        is_due: tells by connection and time of recording which of the wanted ones are worth the time to decode them.
    """
    decoders: dict[tuple[str, str], Callable[[bytes], Any] | str] = {}
    lost: Counter[str] = Counter()
    for connection, stamp, data in bag.messages(wanted):
        if not is_due(connection, stamp):
            continue
        kind = connection.type, connection.definition
        if kind not in decoders:
            decoders[kind] = _decoder(*kind)
        decoder = decoders[kind]
        try:
            if isinstance(decoder, str):
                raise LookupError(decoder)
            take(connection, stamp, decoder(data))
        except _ERRORS:
            reason = decoder if isinstance(decoder, str) else f"do not fit as {connection.type}"
            lost[printable(f"messages on {connection.topic} {reason}")] += 1
    return tuple(f"{count} {what}" for what, count in lost.items())


def _decoder(name: str, definition: str) -> Callable[[bytes], Any] | str:
    """Return a function that decodes messages of a type, or why there is none."""
    try:
        store, known = types_of(name, definition)
    except LookupError:
        return f"are of the type {name}, which the bag does not define"
    except TypesysError:
        return f"are of the type {name}, whose definition makes no sense"
    return lambda data: store.deserialize_ros1(data, known)
