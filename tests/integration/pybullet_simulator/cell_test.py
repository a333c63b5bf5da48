#!/usr/bin/env python3
"""The work cell on ROS: arms follow trajectories and stop at resistance, grippers move, the camera takes settings."""

import threading
import unittest

import actionlib
import cv2
import dynamic_reconfigure.client
import numpy as np
import rospy
import rostest
from control_msgs.msg import (
    FollowJointTrajectoryAction,
    FollowJointTrajectoryGoal,
    FollowJointTrajectoryResult,
    GripperCommand,
    GripperCommandAction,
    GripperCommandGoal,
)
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from helpers.waiting import wait_for
from node_kit.ros.action_server import wait_for_server
from node_kit.ros.goals import send_and_wait
from pybullet_simulator.messages.arms import joint_names
from sensor_msgs.msg import Image
from simulator_msgs.msg import ArmState
from simulator_msgs.srv import DeleteObstacle, SetLight, SpawnObstacle
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectoryPoint

DEADLINE = 120.0


class Newest:
    """Keeps the newest message of a topic."""

    def __init__(self, topic, kind, **settings):
        self.message = None
        self._news = threading.Event()
        self._subscriber = rospy.Subscriber(topic, kind, self._take, queue_size=50, **settings)

    def _take(self, message):
        self.message = message
        self._news.set()

    def next(self):
        self._news.clear()
        if not self._news.wait(DEADLINE):
            raise AssertionError("no message comes")
        return self.message


class CellTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("cell_test")
        cls.state = Newest("simulator/left_arm/state", ArmState)
        cls.levels = {}
        cls.diagnostics = rospy.Subscriber("/diagnostics", DiagnosticArray, cls.take_statuses, queue_size=50)
        cls.arm = actionlib.ActionClient("left_arm/follow_joint_trajectory", FollowJointTrajectoryAction)
        cls.gripper = actionlib.ActionClient("left_arm/gripper_command", GripperCommandAction)
        for client in (cls.arm, cls.gripper):
            assert wait_for_server(client, DEADLINE)
        # An arm that has not heard yet where it is refuses goals, and reports nothing.
        reports = {f"{name}_arm: safety" for name in ("left", "right")}
        wait_for(lambda: reports <= cls.levels.keys(), lambda: f"both arms report: {sorted(cls.levels)}", DEADLINE)

    @classmethod
    def take_statuses(cls, message):
        cls.levels.update({status.name: status.level for status in message.status})

    def move(self, shoulder, seconds, start=None, names=None):
        """Turn the shoulder by an angle; return the result."""
        here = list(start or self.state.next().positions)
        there = [here[0] + shoulder, *here[1:]]
        goal = FollowJointTrajectoryGoal()
        goal.trajectory.joint_names = names or joint_names("left")
        goal.trajectory.points = [
            JointTrajectoryPoint(positions=here, velocities=[0.0] * 7, time_from_start=rospy.Duration(0)),
            JointTrajectoryPoint(
                positions=there, velocities=[0.0] * 7, time_from_start=rospy.Duration.from_sec(seconds)
            ),
        ]
        return send_and_wait(self.arm, goal, DEADLINE).get_result()

    def test_arm_stops_at_an_obstacle_until_it_is_released(self):
        begin = self.state.next().positions
        self.assertEqual(self.move(-0.3, 1.5).error_code, FollowJointTrajectoryResult.SUCCESSFUL)
        self.assertAlmostEqual(self.state.next().positions[0], begin[0] - 0.3, delta=0.02)
        # A wall on the table, into which the arm turns.
        spawn = rospy.ServiceProxy("simulator/spawn_obstacle", SpawnObstacle)
        self.assertTrue(spawn(name="wall", x=-0.22, y=0.3, length=0.3, width=0.04, height=0.7).success)
        result = self.move(-1.2, 3.0)
        self.assertEqual(result.error_code, FollowJointTrajectoryResult.PATH_TOLERANCE_VIOLATED)
        self.assertIn("safety stop", result.error_string)
        wait_for(lambda: self.levels.get("left_arm: safety") == DiagnosticStatus.ERROR, "the driver says so", DEADLINE)
        self.assertEqual(self.levels.get("right_arm: safety"), DiagnosticStatus.OK)
        self.assertEqual(self.move(0.3, 1.5).error_code, FollowJointTrajectoryResult.INVALID_GOAL)
        rospy.ServiceProxy("simulator/delete_obstacle", DeleteObstacle)("wall")
        release = rospy.ServiceProxy("left_arm/release", Trigger)
        wait_for(lambda: release().success, "the arm can be released", DEADLINE)
        wait_for(lambda: self.levels.get("left_arm: safety") == DiagnosticStatus.OK, "the driver says so", DEADLINE)
        self.assertEqual(self.move(0.3, 1.5).error_code, FollowJointTrajectoryResult.SUCCESSFUL)

    def test_trajectory_of_other_joints_or_from_elsewhere_is_refused(self):
        other = self.move(0.1, 1.0, names=joint_names("right"))
        self.assertEqual(other.error_code, FollowJointTrajectoryResult.INVALID_GOAL)
        self.assertIn("this arm has", other.error_string)
        far = [position + 0.5 for position in self.state.next().positions]
        self.assertIn("begins more than", self.move(0.1, 1.0, start=far).error_string)

    def test_gripper_closes_and_opens(self):
        for width in (0.02, 0.08):
            ended = send_and_wait(self.gripper, GripperCommandGoal(GripperCommand(width, 20.0)), DEADLINE)
            self.assertTrue(ended.get_result().reached_goal)
            self.assertAlmostEqual(self.state.next().gripper_width, width, delta=0.004)
        ended = send_and_wait(self.gripper, GripperCommandGoal(GripperCommand(0.5, 20.0)), DEADLINE)
        self.assertEqual(ended.get_goal_status(), actionlib.GoalStatus.REJECTED)

    def test_tags_are_seen_by_the_settings_that_suit_the_light(self):
        images = Newest("camera/image_raw", Image, buff_size=1 << 22)
        settings = dynamic_reconfigure.client.Client("camera", timeout=DEADLINE)
        set_light = rospy.ServiceProxy("simulator/set_light", SetLight)
        for light, suits, exposure, gain in (
            (1.0, True, 0.002, 1.0),
            (1.0, False, 0.03, 4.0),
            (0.03, True, 0.03, 4.0),
            (0.03, False, 0.002, 1.0),
        ):
            self.assertTrue(set_light(light).success)
            settings.update_configuration({"exposure": exposure, "gain": gain})
            wait_for(lambda: bool(tags_in(images.next())) == suits, f"light {light}, exposure {exposure}", DEADLINE)  # noqa: B023
        self.assertFalse(set_light(2.0).success)


def tags_in(message):
    """Return the ids of the tags in an image."""
    pixels = np.frombuffer(message.data, np.uint8).reshape(message.height, message.width, 3)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    _, ids, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY))
    return [] if ids is None else sorted(ids.ravel().tolist())


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "cell_test", CellTest)
