"""What the goals of an objective's action tell of its task."""

from __future__ import annotations

from typing import Any

from actionlib_msgs.msg import GoalStatus

from mros1_reasoner.loop.diagnostics import newest_goal

_AT_WORK = (GoalStatus.PENDING, GoalStatus.ACTIVE, GoalStatus.PREEMPTING, GoalStatus.RECALLING)


class TaskGoals:
    """The newest goal of each objective's action.

    A goal that had ended when its action was heard of first is no news. actionlib lists it for 5 s more, and a reasoner
    that takes the place of one that died would blame the design that runs now for what another one did.
    """

    def __init__(self) -> None:
        self._newest: dict[str, tuple[str, bool] | None] = {}

    def take(self, objective: str, statuses: Any) -> bool | None:
        """Take in a GoalStatusArray. Return whether the newest goal has failed if that is news, else None."""
        newest, is_first = newest_goal(statuses), objective not in self._newest
        before = self._newest.setdefault(objective, newest)
        if newest is None or (newest == before and not is_first):
            return None
        self._newest[objective] = newest
        if is_first and not _is_at_work(newest[0], statuses):
            return None
        return newest[1]


def _is_at_work(goal: str, statuses: Any) -> bool:
    return any(status.goal_id.id == goal and status.status in _AT_WORK for status in statuses.status_list)
