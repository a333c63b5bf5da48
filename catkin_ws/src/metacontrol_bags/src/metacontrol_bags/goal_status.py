"""States of an action's goal."""

from __future__ import annotations

from enum import Enum


class GoalStatus(Enum):
    """The goal's state as `actionlib_msgs/GoalStatus` numbers it."""

    PENDING = 0
    ACTIVE = 1
    PREEMPTED = 2
    SUCCEEDED = 3
    ABORTED = 4
    REJECTED = 5
    PREEMPTING = 6
    RECALLING = 7
    RECALLED = 8
    LOST = 9

    @classmethod
    def of(cls, number: int) -> GoalStatus:
        """Return the state of a number; LOST where there is no such number."""
        return cls(number) if 0 <= number <= cls.LOST.value else cls.LOST

    @property
    def live(self) -> bool:
        """Whether the server still pursues the goal."""
        return self in (GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.PREEMPTING, GoalStatus.RECALLING)
