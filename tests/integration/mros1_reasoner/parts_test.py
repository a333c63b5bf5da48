#!/usr/bin/env python3
"""Parts of one of two robots' meta-controllers die: the others tell it, they come back, and the robot still adapts."""

import os
import signal
import subprocess
import unittest
from pathlib import Path

import rosgraph
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from helpers.waiting import DEADLINE_S, wait_for
from metacontrol_msgs.msg import ActiveConfiguration, Decision
from node_kit.io.xml_rpc import CallError, Client
from std_srvs.srv import Trigger

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
PARTS = ("rosgraph_monitor", "reasoner", "rosgraph_manipulator", "rosgraph_launcher")
MESSAGE = "Part of the meta-controller"


class PartsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("parts_test")

    def setUp(self):
        self.active, self.executed, self.refused, self.told = {}, {}, [], []
        for robot in ("/amber", "/basil"):
            rospy.Subscriber(
                f"{robot}/rosgraph_manipulator/active_configuration", ActiveConfiguration, self.take_active, robot
            )
            rospy.Subscriber(f"{robot}/mros1_reasoner/decision", Decision, self.take_decision, robot, queue_size=100)
        rospy.Subscriber("/diagnostics", DiagnosticArray, self.take, queue_size=100)
        self.signs = []
        for robot in ("/amber", "/basil"):
            rospy.Subscriber(f"{robot}/metacontrol_parts", DiagnosticStatus, self.take_sign, queue_size=100)
        paths = {
            "ROS_PACKAGE_PATH": f"{EXAMPLES / 'talker_listener'}:{EXAMPLES / 'two_robots'}",
            "PYTHONPATH": EXAMPLES / "talker_listener" / "src",
        }
        environment = {name: f"{path}:{os.environ.get(name, '')}" for name, path in paths.items()}
        process = subprocess.Popen(
            ["roslaunch", "--wait", "two_robots", "two_robots.launch"],
            env={**os.environ, **environment},
            stdin=subprocess.DEVNULL,
        )
        self.addCleanup(process.wait, DEADLINE_S)
        self.addCleanup(process.send_signal, signal.SIGINT)

    def take_active(self, message, robot):
        self.active[robot] = [(f.configuration, f.state) for f in message.functions]

    def take_decision(self, decision, robot):
        if decision.state == "FAILED":
            self.refused.append(decision.explanation)
        if decision.state == "EXECUTED":
            self.executed.setdefault(robot, []).append(decision.to_configuration)

    def refuses_to_change(self):
        self.stop_talker()
        return any("locked by the operator" in text for text in self.refused)

    def has_changed(self):
        if self.executed.get("/amber"):
            return True
        if self.is_stable("/amber"):
            self.stop_talker()
        return False

    def is_stable(self, robot):
        return [state for _, state in self.active.get(robot, [])] == ["STABLE"]

    def take_sign(self, status):
        self.signs.append(status.name)

    def take(self, array):
        self.told += [(s.name, s.level) for s in array.status if s.message == MESSAGE]

    def ask(self, service):
        return rospy.ServiceProxy(f"/amber/reasoner/{service}", Trigger)()

    def locks_all(self):
        try:
            return self.ask("lock").success
        except rospy.ServiceException:
            return False

    def process_of(self, node):
        """Return the process of a node, 0 where none answers."""
        try:
            with Client(rosgraph.Master("/test").lookupNode(node), "/test", timeout=1.0) as client:
                return client.call("getPid")
        except (CallError, OSError, rosgraph.MasterException):
            return 0

    def is_heard(self, node):
        """Return whether a part has given signs of life since all other parts, and this test, have been connected."""
        topic = f"{node.rpartition('/')[0]}/metacontrol_parts"
        try:
            with Client(rosgraph.Master("/test").lookupNode(node), "/test", timeout=1.0) as client:
                links = client.call("getBusInfo")
        except (CallError, OSError, rosgraph.MasterException):
            return False
        if sum(link[2] == "o" and link[4] == topic for link in links) < len(PARTS) + 1:  # a node hears itself, too
            self.signs.clear()
        return self.signs.count(node) >= 2

    def stop_talker(self):
        """Have the talker of amber hang that runs now; a launcher that has come back may have started another."""
        process = self.process_of("/amber/talker")
        if process:
            os.kill(process, signal.SIGSTOP)

    def test_each_part_that_dies_is_told_and_comes_back(self):
        wait_for(lambda: self.is_stable("/amber") and self.is_stable("/basil"), "both robots talk")
        for part in PARTS:
            node = f"/amber/{part}"
            dead = wait_for(lambda node=node: self.process_of(node), f"{node} runs")
            wait_for(lambda node=node: self.is_heard(node), f"all others hear {node}")
            self.told.clear()
            if part == "reasoner":
                wait_for(self.locks_all, "the reasoner is locked")
            os.kill(dead, signal.SIGSTOP)  # roslaunch might start a dead one again before anybody misses it
            wait_for(lambda node=node: (node, 2) in self.told, f"somebody tells that {node} is lost")
            os.kill(dead, signal.SIGKILL)
            wait_for(lambda node=node: (node, 0) in self.told, f"somebody tells that {node} is there again")
            wait_for(lambda node=node, dead=dead: self.process_of(node) not in (0, dead), f"another {node} runs")
        self.assertFalse([node for node, _ in self.told if node.startswith("/basil")])
        wait_for(lambda: self.is_stable("/amber"), "amber talks")
        wait_for(self.refuses_to_change, "the second reasoner is locked, too")
        self.executed.clear()
        self.ask("unlock")
        wait_for(self.has_changed, "amber adapts")

    def test_part_that_is_asked_to_end_is_not_lost(self):
        wait_for(lambda: self.is_heard("/basil/reasoner"), "all others hear the reasoner")
        dead = wait_for(lambda: self.process_of("/basil/reasoner"), "it runs")
        self.told.clear()
        os.kill(dead, signal.SIGTERM)
        wait_for(lambda: self.process_of("/basil/reasoner") not in (0, dead), "roslaunch starts it again")
        self.assertEqual(self.told, [])


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "parts", PartsTest)
