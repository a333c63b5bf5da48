"""Decides what the relay of an action does with a goal while the server behind it is replaced.

A client sees one goal from the beginning to the end, whichever server pursues it.
"""

from __future__ import annotations

import enum
from collections.abc import Collection, Mapping
from dataclasses import dataclass

from actionlib_msgs.msg import GoalStatus

# What a server says of its goals when it is shut down.
_DROPPED = frozenset({GoalStatus.PREEMPTED, GoalStatus.ABORTED, GoalStatus.RECALLED})


class Ending(enum.Enum):
    """How a goal ends for its client."""

    SUCCEEDED = "succeeded"
    ABORTED = "aborted"
    CANCELLED = "cancelled"


class ServedFunctions:
    """The functions whose changes concern the server behind a relay.

    That is the function that the relay was given. Without one, they are those whose nodes served the action last, as
    far as the launchers tell. Where nobody has said so yet, each function may be meant.
    """

    def __init__(self, given: str = "") -> None:
        """Begin with the function that the relay was given; empty: none."""
        self._known = frozenset({given} - {""})
        self._is_given = bool(given)
        self._launched: Mapping[str, Mapping[str, frozenset[str]]] = {}

    def launched(self, launcher: str, nodes: Mapping[str, Collection[str]]) -> None:
        """Note which nodes a launcher has for each function."""
        self._launched = {**self._launched, launcher: {name: frozenset(own) for name, own in nodes.items()}}

    def served_by(self, nodes: Collection[str]) -> None:
        """Note which nodes serve the action now."""
        if self._is_given:
            return
        functions = [item for launched in self._launched.values() for item in launched.items()]
        self._known = frozenset(name for name, own in functions if not own.isdisjoint(nodes)) or self._known

    def concern(self, functions: Collection[str]) -> bool:
        """Tell whether one of these functions is meant."""
        return not self._known.isdisjoint(functions) if self._known else bool(functions)


@dataclass
class Link:
    """One goal of a client.

    Attributes:
        sent: whether the goal was sent to the server that is there now.
        cancelled: whether the client has cancelled it.
    """

    sent: bool = False
    cancelled: bool = False

    def needs_sending(self, changing: bool) -> bool:
        """Tell whether the goal must be sent to the server; not while the server is being replaced."""
        return not (self.sent or self.cancelled or changing)

    def cancel(self) -> Ending | None:
        """Cancel the goal. Return how it ends where no server has it; None where the server must end it."""
        self.cancelled = True
        return None if self.sent else Ending.CANCELLED

    def ended_behind(self, state: int, changing: bool) -> Ending | None:
        """Process the end of the goal at the server.

        Args:
            state: its last state there. LOST means that a new server does not know the goal.
            changing: whether the server is being replaced, and may have dropped the goal for that reason.

        Returns:
            How the goal ends for the client; None: it goes on, and must be sent again.
        """
        self.sent = False
        if state == GoalStatus.SUCCEEDED:
            return Ending.SUCCEEDED
        if self.cancelled:
            return Ending.CANCELLED
        if state == GoalStatus.LOST or (changing and state in _DROPPED):
            return None
        return Ending.CANCELLED if state in (GoalStatus.PREEMPTED, GoalStatus.RECALLED) else Ending.ABORTED
