"""Decides what the relay of an action does with a goal while the server behind it is replaced.

A client sees one goal from the beginning to the end, whichever server pursues it.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass

from actionlib_msgs.msg import GoalStatus

# What a server says of its goals when it is shut down.
_DROPPED = frozenset({GoalStatus.PREEMPTED, GoalStatus.ABORTED, GoalStatus.RECALLED})


class Ending(enum.Enum):
    """How a goal ends for its client."""

    SUCCEEDED = "succeeded"
    ABORTED = "aborted"
    CANCELLED = "cancelled"


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
