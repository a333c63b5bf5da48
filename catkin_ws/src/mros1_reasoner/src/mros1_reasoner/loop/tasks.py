"""Whether a task has failed, from what its action server says, pure."""

from __future__ import annotations

from typing import Any

from actionlib_msgs.msg import GoalStatus

_FAILED = (GoalStatus.ABORTED, GoalStatus.REJECTED, GoalStatus.LOST)


def newest_goal(statuses: Any) -> tuple[str, bool] | None:
    """Return the newest goal's id in a GoalStatusArray, and whether it ended badly; None where there is no goal."""
    newest = max(statuses.status_list, key=lambda status: status.goal_id.stamp, default=None)
    return None if newest is None else (newest.goal_id.id, newest.status in _FAILED)
