"""Node one_arm_builder: builds the pyramid by one arm; the base brings it to what is out of reach (design FD1).

Another node says where the cell is (`cell_pose`), and another one drives the base (the action `move_position`).
"""

from __future__ import annotations

import actionlib
import rospy
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from node_kit.parameters import ParameterError, ParameterTree
from node_kit.ros.action_server import wait_for_server
from node_kit.ros.goals import send_and_wait
from node_kit.ros.lifetime import Lifetime
from pybullet_simulator.robot.manipulator import HOME

from metacontrol_manipulation.pick_place.next_step import one_arm
from metacontrol_manipulation.ros.approach import CELL
from metacontrol_manipulation.ros.builder import Builder
from metacontrol_manipulation.ros.errors import RobotError
from metacontrol_manipulation.ros.places import BaseOdometry, GivenCell, home_of
from metacontrol_manipulation.ros.robot import RosRobot

_WAY = 40.0
"""s for a way along the table, and for the cell to be found again."""
_SERVER = 10.0
"""s, wall, in which a server that is started anew is there again."""


class MovePosition:
    """Client of the action `move_position`."""

    def __init__(self) -> None:
        """Look for the server."""
        self._client = actionlib.ActionClient("move_position", MoveBaseAction)

    def go(self, y: float) -> bool:
        """Have the base go to y in m along the table; return whether it is there."""
        if not wait_for_server(self._client, _SERVER):
            rospy.logwarn(f"nobody offers {rospy.resolve_name('move_position')}: the base stays where it is")
            return False
        goal = MoveBaseGoal()
        goal.target_pose.header.frame_id = CELL
        goal.target_pose.pose.position.x, goal.target_pose.pose.position.y = HOME.x, y
        goal.target_pose.pose.orientation.w = 1.0
        ended = send_and_wait(self._client, goal, _WAY)
        return bool(ended and ended.get_goal_status() == actionlib.GoalStatus.SUCCEEDED)


def main() -> None:
    """Run the node; exit status 2 when a parameter cannot be used, or a part of the robot is not there."""
    with Lifetime("one_arm_builder", ParameterError, RobotError) as life:
        life.start()
        parameters = ParameterTree(rospy.get_param("~", {}), rospy.get_name())
        arm = parameters.choice("arm", "left", ("left", "right"))
        patience = parameters.number("patience", 10.0, low=0.1)
        max_age = parameters.number("max_age", 2.0, low=0.1)
        place = GivenCell(BaseOdometry(), patience, max_age, home_of(parameters))
        Builder(RosRobot(place, MovePosition().go), one_arm(arm))
        rospy.spin()
