"""Node approach: moves the base to places that are told relative to the cell (design FD1.1)."""

from __future__ import annotations

import math

import rospy
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal, MoveBaseResult
from node_kit.parameters import ParameterError, ParameterTree
from node_kit.ros.lifetime import Lifetime

from metacontrol_manipulation.ros.action_server import SimpleServer
from metacontrol_manipulation.ros.drive import Drive
from metacontrol_manipulation.ros.errors import RobotError
from metacontrol_manipulation.ros.places import BaseOdometry, GivenCell, pose_of

CELL = "cell"
"""Frame of the goals."""
_BLIND = 1.0
"""s without a view of the tags after which the base stands still: until then it has moved by 25 cm."""


class Approach:
    """Offers the action `move_position`, of the type move_base_msgs/MoveBase, with goals in the frame `cell`."""

    def __init__(self) -> None:
        """Read the parameters and offer the action.

        Raises:
            ParameterError: a parameter cannot be used.
        """
        parameters = ParameterTree(rospy.get_param("~", {}), rospy.get_name())
        self._patience = parameters.number("patience", 10.0, low=0.1)
        self._odometry = BaseOdometry()
        self._cell = GivenCell(self._odometry, self._patience)
        self._drive = Drive(self._odometry, self._cell)
        self._server = SimpleServer("move_position", MoveBaseAction, self._move, auto_start=False)
        self._server.start()

    def _move(self, goal: MoveBaseGoal) -> None:
        frame = goal.target_pose.header.frame_id
        if frame != CELL:
            self._server.set_aborted(MoveBaseResult(), f"the goal is in the frame {frame!r}: give it in {CELL!r}")
            return
        target = pose_of(goal.target_pose.pose)
        if not all(map(math.isfinite, (target.x, target.y, target.yaw))):
            self._server.set_aborted(MoveBaseResult(), "the goal is not finite: give numbers for its position and yaw")
            return
        try:
            self._cell.wait()
            arrived = self._drive.go(
                target,
                lambda: not self._server.is_preempt_requested(),
                self._may_move,
                patience=30.0 + self._patience,
            )
        except (RobotError, rospy.exceptions.ROSTimeMovedBackwardsException) as error:
            self._server.set_aborted(MoveBaseResult(), str(error))
            return
        if arrived:
            self._server.set_succeeded()
        elif self._server.is_preempt_requested():
            self._server.set_preempted()
        else:
            self._server.set_aborted(MoveBaseResult(), "the base has not arrived: something is in its way")

    def _may_move(self) -> bool:
        """Tell whether the tags are in sight; raise RobotError when they have not been for long."""
        age = self._cell.age
        if age > self._patience:
            raise RobotError(f"no tag is seen for {self._patience:g} s, so the base stands: see light and camera")
        return age <= _BLIND


def main() -> None:
    """Run the node; exit status 2 when a parameter cannot be used."""
    with Lifetime("approach", ParameterError) as life:
        life.start()
        Approach()
        rospy.spin()
