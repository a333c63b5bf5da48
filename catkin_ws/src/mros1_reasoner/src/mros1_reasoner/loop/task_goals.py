"""What the goals of an objective's action tell of its task."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from actionlib_msgs.msg import GoalStatus

from mros1_reasoner.loop.diagnostics import newest_goal

_AT_WORK = (GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.PREEMPTING, GoalStatus.RECALLING)


class TaskGoals:
    """The newest goal of each objective's action.

    A goal that had ended when its action was heard of first is no news. actionlib lists it for 5 s more, and a reasoner
    that takes the place of one that died would blame the design that runs now for what another one did. It is news only
    where that one has left it at work.
    """

    def __init__(self, left: Mapping[str, str]) -> None:
        """Begin with the ids of the goals that a reasoner before has left at work, by objective."""
        self._left = dict(left)
        self._newest: dict[str, tuple[str, bool] | None] = {}
        self._at_work: dict[str, str] = {}

    @property
    def at_work(self) -> dict[str, str]:
        """Ids of the newest goals that are at work, by objective; of an action not heard of yet, as it was left."""
        left = {name: goal for name, goal in self._left.items() if name not in self._newest}
        return left | {name: goal for name, goal in self._at_work.copy().items() if goal}

    def take(self, objective: str, statuses: Any) -> bool | None:
        """Take in a GoalStatusArray. Return whether the newest goal has failed if that is news, else None."""
        newest, is_first = newest_goal(statuses), objective not in self._newest
        before = self._newest.setdefault(objective, newest)
        if newest is None:
            return None
        is_at_work = _is_at_work(newest[0], statuses)
        self._at_work[objective] = newest[0] if is_at_work else ""
        if newest == before and not is_first:
            return None
        self._newest[objective] = newest
        if is_first and not is_at_work and newest[0] != self._left.get(objective):
            return None
        return newest[1]


def _is_at_work(goal: str, statuses: Any) -> bool:
    return any(status.goal_id.id == goal and status.status in _AT_WORK for status in statuses.status_list)
