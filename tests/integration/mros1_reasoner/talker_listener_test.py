#!/usr/bin/env python3
"""The example of a talker that hangs: another executable takes its place, and gives it back."""

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

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "talker_listener"


class TalkerListenerTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("talker_listener_test")

    def setUp(self):
        self.decisions, self.active, self.heard = [], "", []
        rospy.Subscriber("mros1_reasoner/decision", Decision, self.decisions.append, queue_size=100)
        rospy.Subscriber("rosgraph_manipulator/active_configuration", ActiveConfiguration, self.take_active)
        rospy.Subscriber("chatter", Header, self.heard.append, queue_size=100)
        paths = {"ROS_PACKAGE_PATH": str(EXAMPLE), "PYTHONPATH": str(EXAMPLE / "src")}  # the example is not built here
        environment = {name: f"{path}:{os.environ.get(name, '')}" for name, path in paths.items()}
        self.launch = subprocess.Popen(
            ["roslaunch", "--wait", "talker_listener", "talker_listener.launch"],
            env={**os.environ, **environment},
            stdin=subprocess.DEVNULL,
        )
        self.addCleanup(self.launch.wait, DEADLINE_S)
        self.addCleanup(self.launch.send_signal, signal.SIGINT)

    def take_active(self, message):
        self.active = next((f.configuration for f in message.functions if f.state == "STABLE"), "")

    def executed(self):
        return [(d.from_configuration, d.to_configuration) for d in self.decisions if d.state == "EXECUTED"]

    def talker(self):
        """Return the process of the talker that runs, 0 where none answers."""
        try:
            return ServerProxy(rosgraph.Master("/test").lookupNode("/talker")).getPid("/test")[2]
        except (OSError, rosgraph.MasterException):
            return 0

    def test_hung_talker_is_replaced_and_comes_back(self):
        wait_for(lambda: self.active == "frugal" and self.heard, "the frugal talker talks")
        os.kill(self.talker(), signal.SIGSTOP)
        wait_for_equal(self.executed, [("frugal", "fast"), ("fast", "frugal")], "what is executed")
        self.assertIn("freshness", self.decisions[0].trigger)
        wait_for(lambda: self.active == "frugal", "the frugal talker runs again")

    def test_talker_that_dies_is_started_again(self):
        wait_for(lambda: self.active == "frugal" and self.heard, "the frugal talker talks")
        dead = self.talker()
        os.kill(dead, signal.SIGKILL)
        wait_for(lambda: self.talker() not in (0, dead), "another talker runs")
        self.heard.clear()
        wait_for(lambda: self.heard, "it is heard")


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "talker_listener", TalkerListenerTest)
