"""What the relay of an action does with its goals while the server behind it comes and goes.

Clients see one goal at work from the beginning to the end, whatever server pursues it.
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
        sent: whether the server behind has it.
        cancelled: whether its client has taken it back.
    """

    sent: bool = False
    cancelled: bool = False

    def needs_sending(self, changing: bool) -> bool:
        """Whether the goal is to be sent to the server behind; not while that is being replaced."""
        return not (self.sent or self.cancelled or changing)

    def cancel(self) -> Ending | None:
        """Take the goal back; it ends at once where no server has it, else when the server says so."""
        self.cancelled = True
        return None if self.sent else Ending.CANCELLED

    def ended_behind(self, state: int, changing: bool) -> Ending | None:
        """Take in that the goal has ended at the server behind.

        Args:
            state: its last state there; LOST: the server knows nothing of it, so it is another one.
            changing: whether the server is being replaced, so that it may have dropped the goal for that.

        Returns:
            How it ends for the client; None: it does not, and is to be sent again.
        """
        self.sent = False
        if state == GoalStatus.SUCCEEDED:
            return Ending.SUCCEEDED
        if self.cancelled:
            return Ending.CANCELLED
        if state == GoalStatus.LOST or (changing and state in _DROPPED):
            return None
        return Ending.CANCELLED if state in (GoalStatus.PREEMPTED, GoalStatus.RECALLED) else Ending.ABORTED
