#!/usr/bin/env python3
"""The examples of a talker that hangs: another executable takes its place, for one robot and for one of two."""

import os
import signal
import subprocess
import unittest
from pathlib import Path
from xmlrpc.client import ServerProxy

import rosgraph
import rospy
import rostest
from helpers.waiting import DEADLINE_S, wait_for, wait_for_equal
from metacontrol_msgs.msg import ActiveConfiguration, Decision
from std_msgs.msg import Header

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
THERE_AND_BACK = [("frugal", "fast"), ("fast", "frugal")]


class Robot:
    """What is heard of a robot in a namespace."""

    def __init__(self, namespace=""):
        self.namespace, self.decisions, self.active, self.heard = namespace, [], "", 0
        active = f"{namespace}/rosgraph_manipulator/active_configuration"
        rospy.Subscriber(f"{namespace}/mros1_reasoner/decision", Decision, self.decisions.append, queue_size=100)
        rospy.Subscriber(active, ActiveConfiguration, self.take_active)
        rospy.Subscriber(f"{namespace}/chatter", Header, self.take_message, queue_size=100)

    def take_active(self, message):
        self.active = next((f.configuration for f in message.functions if f.state == "STABLE"), "")

    def take_message(self, _message):
        self.heard += 1

    def is_frugal(self):
        return self.active == "frugal" and self.heard

    def executed(self):
        return [(d.from_configuration, d.to_configuration) for d in self.decisions if d.state == "EXECUTED"]

    def talker(self):
        """Return the process of the talker that runs, 0 where none answers."""
        try:
            return ServerProxy(rosgraph.Master("/test").lookupNode(f"{self.namespace}/talker")).getPid("/test")[2]
        except (OSError, rosgraph.MasterException):
            return 0

    def running_talker(self):
        """Wait until a talker answers; return its process."""
        return wait_for(self.talker, "a talker answers")


class TalkerListenerTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("talker_listener_test")

    def launch(self, package):
        """Launch an example, which is not built here."""
        robot = EXAMPLES / "talker_listener"
        paths = {"ROS_PACKAGE_PATH": f"{robot}:{EXAMPLES / 'two_robots'}", "PYTHONPATH": robot / "src"}
        environment = {name: f"{path}:{os.environ.get(name, '')}" for name, path in paths.items()}
        words = ["roslaunch", "--wait", package, f"{package}.launch"]
        process = subprocess.Popen(words, env={**os.environ, **environment}, stdin=subprocess.DEVNULL)
        self.addCleanup(process.wait, DEADLINE_S)
        self.addCleanup(process.send_signal, signal.SIGINT)

    def test_hung_talker_is_replaced_and_comes_back(self):
        robot = Robot()
        self.launch("talker_listener")
        wait_for(robot.is_frugal, "the frugal talker talks")
        os.kill(robot.running_talker(), signal.SIGSTOP)
        wait_for_equal(robot.executed, THERE_AND_BACK, "what is executed")
        self.assertIn("freshness", robot.decisions[0].trigger)
        wait_for(robot.is_frugal, "the frugal talker runs again")

    def test_talker_that_dies_is_started_again(self):
        robot = Robot()
        self.launch("talker_listener")
        wait_for(robot.is_frugal, "the frugal talker talks")
        dead = robot.running_talker()
        os.kill(dead, signal.SIGKILL)
        wait_for(lambda: robot.talker() not in (0, dead), "another talker runs")
        robot.heard = 0
        wait_for(lambda: robot.heard, "it is heard")

    def test_only_the_robot_whose_talker_hangs_adapts(self):
        amber, basil = Robot("/amber"), Robot("/basil")
        self.launch("two_robots")
        wait_for(lambda: amber.is_frugal() and basil.is_frugal(), "both talk")
        os.kill(amber.running_talker(), signal.SIGSTOP)
        wait_for_equal(amber.executed, THERE_AND_BACK, "what amber executes")
        self.assertEqual(basil.executed(), [])
        self.assertTrue(basil.is_frugal())


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "talker_listener", TalkerListenerTest)
