#!/usr/bin/env python3
"""Simulated time whose clock starts late: who waits for the manipulator, waits in wall time."""

import unittest

import actionlib
import rosgraph
import rospy
import rostest
from helpers.waiting import wait_for
from integration.rosgraph_manipulator.manipulator_harness import Node
from metacontrol_msgs.msg import MvpReconfigurationAction, MvpReconfigurationResult
from node_kit.ros.action_server import is_connected, wait_for_server
from rosgraph_msgs.msg import Clock

ACTION = "rosgraph_manipulator_action_server"
FIRST = 1000
"""s, ROS time of the first clock: far beyond all timeouts"""


class Manipulator:
    """The manipulator's action server, which deploys whatever is asked for."""

    def __init__(self):
        self.requests = []
        self._server = actionlib.SimpleActionServer(ACTION, MvpReconfigurationAction, self._take, auto_start=False)
        self._server.start()

    def _take(self, goal):
        self.requests.append(goal.desired_configuration_name)
        self._server.set_succeeded(MvpReconfigurationResult(1), "deployed")


class ClockTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("manipulator_clock_test")

    # The tests share a node, whose clock starts in the last one; unittest runs them by name.

    def test_1_no_server_is_found_while_no_clock_runs(self):
        self.assertTrue(rospy.get_rostime().is_zero())
        client = actionlib.ActionClient("nobody", MvpReconfigurationAction)
        self.assertFalse(is_connected(client))
        self.assertFalse(wait_for_server(client, 0.1))

    def test_2_request_waits_for_the_manipulator_when_the_clock_starts(self):
        clock = rospy.Publisher("/clock", Clock, queue_size=1, latch=True)
        node = Node("rosgraph_manipulator", "request", "better")
        self.addCleanup(node.end)
        command = wait_for(self.who_looks, "the command looks for the manipulator")
        wait_for(lambda: clock.impl.has_connection(command), "the command hears the clock")
        clock.publish(Clock(rospy.Time(FIRST)))
        wait_for(lambda: rospy.get_rostime().secs == FIRST, "the clock runs")
        manipulator = Manipulator()
        self.assertEqual(node.wait(), 0, node.said())
        self.assertIn("deployed", node.said())
        self.assertEqual(manipulator.requests, ["better"])

    @staticmethod
    def who_looks():
        """The node that listens to the manipulator's status; None: there is none yet."""
        _, subscribers, _ = rosgraph.Master("/test").getSystemState()
        return next(iter(dict(subscribers).get(f"/{ACTION}/status", ())), None)


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "manipulator_clock", ClockTest)
