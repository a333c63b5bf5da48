"""The goal of a mission, as it is sent to move_base."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy
from actionlib_msgs.msg import GoalID, GoalStatusArray
from metacontrol_bags.goal_status import GoalStatus
from move_base_msgs.msg import MoveBaseActionGoal
from robot_formulas.geometry import quaternion_of

if TYPE_CHECKING:
    from robot_formulas.geometry import Pose


class MissionGoal:
    """Sends one goal under an id of its own, which a restarted server may take over."""

    def __init__(self) -> None:
        """Announce the topics."""
        self.publisher = rospy.Publisher("move_base/goal", MoveBaseActionGoal, queue_size=5)
        self._cancels = rospy.Publisher("move_base/cancel", GoalID, queue_size=5)
        self._goal = MoveBaseActionGoal()

    @property
    def id(self) -> str:
        """Its id; empty before it is made."""
        return str(self._goal.goal_id.id)

    @property
    def is_heard(self) -> bool:
        """Whether an action server listens."""
        return bool(self.publisher.get_num_connections() > 0)

    def make(self, pose: Pose, now: rospy.Time) -> None:
        """Make the goal that is sent from now on: a pose in the map frame."""
        self._goal = goal = MoveBaseActionGoal()
        goal.header.stamp = now
        goal.goal_id = GoalID(stamp=now, id=f"{rospy.get_name()}-1-{now.to_sec():.3f}")
        target = goal.goal.target_pose
        target.header.frame_id, target.header.stamp = "map", now
        target.pose.position.x, target.pose.position.y = pose.x, pose.y
        target.pose.orientation.z, target.pose.orientation.w = quaternion_of(pose.yaw)

    def send(self) -> None:
        """Send the goal, or send it again."""
        self.publisher.publish(self._goal)

    def cancel(self) -> None:
        """Ask the server to give the goal up."""
        self._cancels.publish(self._goal.goal_id)

    def status_in(self, message: GoalStatusArray) -> GoalStatus | None:
        """Return the goal's state, None where the server does not list it."""
        return next((GoalStatus.of(s.status) for s in message.status_list if s.goal_id.id == self.id), None)
