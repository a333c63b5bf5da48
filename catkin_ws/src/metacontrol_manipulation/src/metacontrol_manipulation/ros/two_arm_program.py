"""Node two_arm_program: builds the pyramid by both arms, in one program, from where the robot stands (design FD2)."""

from __future__ import annotations

import actionlib
import rospy
from node_kit.parameters import ParameterError, ParameterTree
from node_kit.ros.lifetime import Lifetime
from pybullet_simulator.robot.manipulator import ARMS, HOME
from robot_formulas.geometry import Pose

from metacontrol_manipulation.handling.handler import Handler
from metacontrol_manipulation.msg import BuildPyramidAction, BuildPyramidFeedback, BuildPyramidResult
from metacontrol_manipulation.pick_place.actions import Action, Done, Stuck
from metacontrol_manipulation.pick_place.building import Building
from metacontrol_manipulation.pick_place.next_step import BOTH_ARMS
from metacontrol_manipulation.ros.robot import RobotError, RosRobot


class TwoArmProgram:
    """Offers the action `build`."""

    def __init__(self) -> None:
        """Read the parameters, connect to the robot, and offer the action.

        Raises:
            ParameterError: a parameter cannot be used.
            RobotError: a part of the robot is not there.
        """
        parameters = ParameterTree(rospy.get_param("~", {}), rospy.get_name())
        usual = {"x": -HOME.x, "y": 0.0, "yaw": 0.0}
        cell = Pose(*(parameters.number(f"cell_{key}", value) for key, value in usual.items()))
        self._robot = RosRobot(lambda: cell, lambda _: False)
        self._handler = Handler(ARMS)
        self._server = actionlib.SimpleActionServer("build", BuildPyramidAction, self._build, auto_start=False)
        self._server.start()

    def _build(self, _goal: object) -> None:
        building = Building(self._robot, self._handler, BOTH_ARMS, lambda action: self._tell(building, action))
        try:
            ending = building.run(lambda: not (rospy.is_shutdown() or self._server.is_preempt_requested()))
        except RobotError as error:
            ending = Stuck(str(error))
        placed = len(building.progress.filled)
        result = BuildPyramidResult(
            isinstance(ending, Done), placed, ending.reason if isinstance(ending, Stuck) else ""
        )
        if ending is None:
            self._server.set_preempted(result)
        elif isinstance(ending, Done):
            self._server.set_succeeded(result)
        else:
            rospy.logerr(result.message)
            self._server.set_aborted(result, result.message)

    def _tell(self, building: Building, action: Action) -> None:
        rospy.loginfo(str(action))
        self._server.publish_feedback(BuildPyramidFeedback(len(building.progress.filled), str(action)))


def main() -> None:
    """Run the node; exit status 2 when a parameter cannot be used, or a part of the robot is not there."""
    with Lifetime("two_arm_program", ParameterError, RobotError) as life:
        life.start()
        TwoArmProgram()
        rospy.spin()
