"""Which messages of a publisher are out of date: those of a process that has ended, or of a connection that was broken.

A node that died and was started again has the same name. What the former process had sent may be on its way still when
the new one is heard. Where messages tell a state, the older one would be believed until the next one comes.
"""

from __future__ import annotations

from collections import deque
from typing import Any

_KEPT = 16
"""Former connections of a publisher that are known; a message of an even older one is not on its way any more."""


class Succession:
    """The connections to the publishers of one topic, in the order in which they were heard first. Not thread-safe."""

    def __init__(self) -> None:
        """Begin with nobody."""
        self._connections: dict[str, deque[Any]] = {}

    def is_late(self, publisher: str, connection: object) -> bool:
        """Note a message, and tell whether a newer connection of its publisher was heard before.

        Args:
            publisher: name of the node that sent it.
            connection: by which it came; connections are told apart by identity.
        """
        known = self._connections.setdefault(publisher, deque(maxlen=_KEPT))
        if any(one is connection for one in known):
            return known[-1] is not connection
        known.append(connection)
        return False
