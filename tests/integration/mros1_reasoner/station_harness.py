"""An assembly station: its package is generated from its models, and all parts of the meta-controller run beside it."""

import os
import shutil
import signal
import subprocess
import tempfile
import unittest
from pathlib import Path

import rospy
from helpers.waiting import DEADLINE_S, wait_for_equal
from metacontrol_msgs.msg import ActiveConfiguration, Decision
from reasoner_harness import node_pid

STATION = Path(__file__).resolve().parent / "station"
PARTS = {"f_assemble": "assembler", "f_grasp": "grasper", "f_look": "looker"}
BEST = {"f_assemble": "screw", "f_grasp": "grasp_fine", "f_look": "look_left"}


class StationTest(unittest.TestCase):
    """Tests of a station in a namespace of its own, or in none."""

    namespace = "/"

    def setUp(self):
        rospy.init_node("station_test")
        self.active, self.told, self.decisions = {}, [], []
        rospy.Subscriber(self.name("mros1_reasoner/decision"), Decision, self.decisions.append, queue_size=100)
        active = self.name("rosgraph_manipulator/active_configuration")
        rospy.Subscriber(active, ActiveConfiguration, self.take, queue_size=100)
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        station = folder / "station"
        shutil.copytree(STATION, station)
        subprocess.run(["rosmodel", "generate", "all", station / "models", "-o", station], check=True)
        own = {"ROS_PACKAGE_PATH": f"{folder}:{os.environ['ROS_PACKAGE_PATH']}", "ROS_NAMESPACE": self.namespace}
        launch = ["roslaunch", "--wait", "station", "station.launch"]
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

    def wait_for_configurations(self, **configurations):
        expected = {function: (name, "STABLE") for function, name in {**BEST, **configurations}.items()}
        wait_for_equal(lambda: self.active, expected, "what runs")

    def pids(self, *functions):
        return {function: node_pid(self.name(PARTS[function])) for function in functions}
