"""The message types of a bag."""

from __future__ import annotations

from collections.abc import Iterable

from rosbags.interfaces import Connection
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore


def typestore(connections: Iterable[Connection]) -> Typestore:
    """Return the standard types and those that the connections of a bag define."""
    store = get_typestore(Stores.ROS1_NOETIC)
    for connection in connections:
        if connection.msgtype not in store.types:
            types = get_types_from_msg(connection.msgdef.data, connection.msgtype)
            store.register({name: fields for name, fields in types.items() if name not in store.types})
    return store
