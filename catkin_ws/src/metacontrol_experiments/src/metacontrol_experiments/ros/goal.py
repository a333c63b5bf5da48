"""The goal of a mission, as it is sent to an action's server."""

from __future__ import annotations

from typing import Any

import rospy
from actionlib_msgs.msg import GoalID, GoalStatusArray
from metacontrol_bags.goal_status import GoalStatus


class MissionGoal:
    """Sends one goal under an id of its own, which a restarted server may take over."""

    def __init__(self, action: str, kind: Any) -> None:
        """Announce the topics.

        Args:
            action: its name.
            kind: class of its action goals, such as MoveBaseActionGoal.
        """
        self.publisher = rospy.Publisher(f"{action}/goal", kind, queue_size=5)
        self._cancels = rospy.Publisher(f"{action}/cancel", GoalID, queue_size=5)
        self._goal = kind()

    @property
    def id(self) -> str:
        """Its id; empty before it is made."""
        return str(self._goal.goal_id.id)

    @property
    def is_heard(self) -> bool:
        """Whether an action server listens."""
        return bool(self.publisher.get_num_connections() > 0)

    def make(self, now: rospy.Time) -> Any:
        """Make the goal that is sent from now on; return its content, to be filled in."""
        goal = self._goal = type(self._goal)()
        goal.header.stamp = now
        goal.goal_id = GoalID(stamp=now, id=f"{rospy.get_name()}-1-{now.to_sec():.3f}")
        return goal.goal

    def send(self) -> None:
        """Send the goal, or send it again."""
        self.publisher.publish(self._goal)

    def cancel(self) -> None:
        """Ask the server to give the goal up."""
        self._cancels.publish(self._goal.goal_id)

    def status_in(self, message: GoalStatusArray) -> GoalStatus | None:
        """Return the goal's state, None where the server does not list it."""
        return next((GoalStatus.of(s.status) for s in message.status_list if s.goal_id.id == self.id), None)
