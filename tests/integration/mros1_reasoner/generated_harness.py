"""A system whose package is generated from its models, with all parts of the meta-controller beside it."""

import os
import shutil
import signal
import subprocess
import tempfile
import unittest
from pathlib import Path

import rospy
from helpers.waiting import DEADLINE_S
from metacontrol_msgs.msg import ActiveConfiguration, Decision

HERE = Path(__file__).resolve().parent


class GeneratedSystemTest(unittest.TestCase):
    """Tests of a system in a namespace of its own, or in none.

    Attributes:
        package: its package, a folder beside this file, with a launch file of that name.
        namespace: where it runs.
        active: what runs, and its state, by function.
        told: messages of the manipulator.
        decisions: of the reasoner.
    """

    package = ""
    namespace = "/"

    def setUp(self):
        rospy.init_node(f"{self.package}_test")
        self.active, self.told, self.decisions = {}, [], []
        rospy.Subscriber(self.name("mros1_reasoner/decision"), Decision, self.decisions.append, queue_size=100)
        active = self.name("rosgraph_manipulator/active_configuration")
        rospy.Subscriber(active, ActiveConfiguration, self.take, queue_size=100)
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        copy = folder / self.package
        shutil.copytree(HERE / self.package, copy)
        subprocess.run(["rosmodel", "generate", "all", copy / "models", "-o", copy], check=True)
        own = {"ROS_PACKAGE_PATH": f"{folder}:{os.environ['ROS_PACKAGE_PATH']}", "ROS_NAMESPACE": self.namespace}
        launch = ["roslaunch", "--wait", self.package, f"{self.package}.launch"]
        self.process = subprocess.Popen(launch, env={**os.environ, **own}, stdin=subprocess.DEVNULL)
        self.addCleanup(self.end)

    def end(self):
        self.process.send_signal(signal.SIGINT)
        self.process.wait(DEADLINE_S)

    def name(self, name):
        return f"{self.namespace.rstrip('/')}/{name}"

    def take(self, message):
        self.active = {f.function: (f.configuration, f.state) for f in message.functions}
        self.told.append(message.message)
