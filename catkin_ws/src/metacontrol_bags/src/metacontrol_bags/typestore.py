"""The message types of a bag."""

from __future__ import annotations

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.msg import normalize_msgtype
from rosbags.typesys.store import Typestore


def types_of(name: str, definition: str) -> tuple[Typestore, str]:
    """Return the standard types and those of a definition, and the name that a type has there.

    Args:
        name: of the type, as PACKAGE/NAME.
        definition: of the type and of those that it uses; empty where nobody has it.

    Raises:
        TypesysError: the definition makes no sense.
        LookupError: the type has no definition.
    """
    store, known = get_typestore(Stores.ROS1_NOETIC), normalize_msgtype(name)
    if known not in store.types:
        if not definition.strip():
            raise LookupError(name)
        _register(store, known, definition)
    return store, known


def _register(store: Typestore, name: str, definition: str) -> None:
    types = get_types_from_msg(definition, name)
    store.register({found: fields for found, fields in types.items() if found not in store.types})
