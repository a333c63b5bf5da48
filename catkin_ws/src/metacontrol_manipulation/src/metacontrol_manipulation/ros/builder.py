"""The action `build`: what all programs that build have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy
from node_kit.ros.resumed_goal import start_with, take_resumed_goal
from pybullet_simulator.robot.manipulator import ARMS

from metacontrol_manipulation.handling.handler import Handler
from metacontrol_manipulation.msg import (
    BuildPyramidAction,
    BuildPyramidActionGoal,
    BuildPyramidFeedback,
    BuildPyramidResult,
)
from metacontrol_manipulation.pick_place.actions import Action, Done, Stuck
from metacontrol_manipulation.pick_place.building import Building
from metacontrol_manipulation.ros.action_server import SimpleServer
from metacontrol_manipulation.ros.errors import RobotError

if TYPE_CHECKING:
    from metacontrol_manipulation.pick_place.building import Robot
    from metacontrol_manipulation.pick_place.next_step import Design

ACTION = "build"


class Builder:
    """Offers the action `build`. Whatever was built before, by whom, it goes on with it.

    A goal that another program has left pending is taken over (`build/resume_goal`), too.
    """

    def __init__(self, robot: Robot, design: Design) -> None:
        """Offer the action.

        Args:
            robot: that builds.
            design: by which arms, and where the base stands.
        """
        self._robot, self._design = robot, design
        self._handler = Handler(ARMS)
        self._server = SimpleServer(ACTION, BuildPyramidAction, self._build, auto_start=False)
        start_with(self._server.action_server, take_resumed_goal(ACTION, BuildPyramidActionGoal))

    def _build(self, _goal: object) -> None:
        building = Building(self._robot, self._handler, self._design, lambda action: self._tell(building, action))
        try:
            ending = building.run(lambda: not (rospy.is_shutdown() or self._server.is_preempt_requested()))
        except (RobotError, rospy.exceptions.ROSTimeMovedBackwardsException) as error:
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
