"""Which messages of a publisher are out of date: those of a process that has ended, or of a connection that was broken.

A node that died and was started again has the same name. What the former process had sent may be on its way still when
the new one is heard. Where messages tell a state, the older one would be believed until the next one comes.
"""

from __future__ import annotations


class Succession:
    """The newest connection of each publisher of one topic that was heard. Not thread-safe."""

    def __init__(self) -> None:
        """Begin with nobody."""
        self._newest: dict[str, int] = {}

    def is_late(self, publisher: str, connection: int) -> bool:
        """Note a message, and tell whether a newer connection of its publisher was heard before.

        Args:
            publisher: name of the node that sent it; of those without a name, nothing is known.
            connection: number of the connection by which it came; those that are made later have higher ones. It is not
                the order in which they are first heard: a broken one may bring its first message last.
        """
        newest = self._newest.get(publisher, connection)
        if publisher:
            self._newest[publisher] = max(newest, connection)
        return bool(publisher) and connection < newest
