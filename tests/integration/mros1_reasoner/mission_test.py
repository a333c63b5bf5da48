#!/usr/bin/env python3
"""The example's missions: three tasks ask for their functions, and the robot adapts when a hand breaks."""

import os
import signal
import subprocess
import unittest
from pathlib import Path

import rospy
import rostest
from helpers.waiting import DEADLINE_S, wait_for_equal
from metacontrol_msgs.msg import ActiveConfiguration, Decision
from rosgraph_msgs.msg import Log

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "example_mission"
TASKS = ("survey", "grip", "dock")
COURSE = [f"{task} {what}" for task in TASKS for what in ("begins", "ends: SUCCESS")]


class MissionTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("mission_test")

    def start(self, mission, namespace):
        """Launch the crawler and a mission in a namespace; keep all that they say."""
        self.course, self.decisions, self.active, self.runs = [], [], None, set()
        self.node = f"{namespace}/mission"
        rospy.Subscriber("/rosout", Log, self.take_log, queue_size=500)
        rospy.Subscriber(f"{namespace}/mros1_reasoner/decision", Decision, self.decisions.append, queue_size=100)
        active = f"{namespace}/rosgraph_manipulator/active_configuration"
        rospy.Subscriber(active, ActiveConfiguration, self.take_active, queue_size=100)
        path = f"{EXAMPLE}:{os.environ['ROS_PACKAGE_PATH']}"
        process = subprocess.Popen(
            ["roslaunch", "--wait", "example_mission", "mission.launch", f"mission:={mission}", "required:=false"],
            env={**os.environ, "ROS_PACKAGE_PATH": path, "ROS_NAMESPACE": namespace},
            stdin=subprocess.DEVNULL,
        )
        self.addCleanup(process.wait, DEADLINE_S)
        self.addCleanup(process.send_signal, signal.SIGINT)

    def take_log(self, line):
        if line.name == self.node and line.msg.split()[0] in (*TASKS, "the"):
            self.course.append(line.msg)

    def take_active(self, message):
        self.active = {function.function: function.configuration for function in message.functions}
        self.runs.add(frozenset(self.active))

    def follow(self):
        """Check the course of events from the first task to the end."""
        wait_for_equal(lambda: self.course, [*COURSE, "the mission ends: SUCCESS"], "the course of the mission")
        executed = [(d.from_configuration, d.to_configuration) for d in self.decisions if d.state == "EXECUTED"]
        self.assertEqual(
            executed,
            [("", "survey_quietly"), ("", "grip_firmly"), ("grip_firmly", "grip_softly"), ("", "dock_slowly")],
        )
        (accident,) = [d for d in self.decisions if d.state == "EXECUTED" and d.from_configuration]
        self.assertEqual(accident.trigger, "component:strong_hand")
        wait_for_equal(lambda: self.active, {}, "what runs after the mission")
        self.assertNotIn(frozenset({"f_survey", "f_grip", "f_dock"}), self.runs, "a task gives its function up")

    def test_behaviour_tree(self):
        self.start("mission_tree", "/site/crawler")
        self.follow()

    def test_states(self):
        self.start("mission_states", "/other")
        self.follow()


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "mission", MissionTest)
