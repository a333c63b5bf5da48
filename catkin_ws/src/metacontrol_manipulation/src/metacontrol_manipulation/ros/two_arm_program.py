"""Node two_arm_program: builds the pyramid by both arms, in one program, from the base's place at home (design FD2)."""

from __future__ import annotations

import rospy
from node_kit.parameters import ParameterError, ParameterTree
from node_kit.ros.lifetime import Lifetime
from robot_formulas.geometry import Pose

from metacontrol_manipulation.pick_place.next_step import BOTH_ARMS
from metacontrol_manipulation.ros.builder import Builder
from metacontrol_manipulation.ros.drive import Drive
from metacontrol_manipulation.ros.errors import RobotError
from metacontrol_manipulation.ros.places import BaseOdometry, OwnTags, home_of
from metacontrol_manipulation.ros.robot import RosRobot

_PATIENCE = 30.0
"""s for the way home."""


def main() -> None:
    """Run the node; exit status 2 when a parameter cannot be used, or a part of the robot is not there."""
    with Lifetime("two_arm_program", ParameterError, RobotError) as life:
        life.start()
        home = home_of(ParameterTree(rospy.get_param("~", {}), rospy.get_name()))
        odometry = BaseOdometry()
        place = OwnTags(odometry, home)
        drive = Drive(odometry, place)

        def move_base(y: float) -> bool:
            return drive.go(Pose(home.x, y, home.yaw), lambda: True, patience=_PATIENCE)

        Builder(RosRobot(place, move_base), BOTH_ARMS)
        rospy.spin()
