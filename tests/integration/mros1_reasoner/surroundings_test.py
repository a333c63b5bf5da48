#!/usr/bin/env python3
"""A climbing robot whose designs need surroundings; what measures these falls silent, and its observer ends."""

import os
import re
import shutil
import signal
import subprocess
import tempfile
import unittest
from pathlib import Path

import rospy
import rostest
from helpers.robot_side import Manipulator
from helpers.waiting import DEADLINE_S, wait_for, wait_for_equal
from metacontrol_msgs.srv import LoadObserver, UnloadObserver
from reasoner_harness import Listener
from std_msgs.msg import Float32

CRAWLER = Path(__file__).resolve().parent / "crawler"
ROBOT = "/yard/crawler_7"
FORMULAS = {"slope": "abs(tilt_degrees.data)", "dust": "dust_density.data"}
PERIOD_S = 0.1


class SurroundingsTest(unittest.TestCase):
    """One story: each part starts from what the one before has left."""

    def setUp(self):
        rospy.init_node("surroundings_test")
        self.manipulator = Manipulator(ROBOT, function="f_climb")
        self.listener = Listener(ROBOT)
        self.measured = {"raw/tilt": 3.0, "dust/density": 0.5, "motor/current": 1.0, "eye/image": 1.0}
        self.topics = {name: rospy.Publisher(f"{ROBOT}/{name}", Float32, queue_size=1) for name in self.measured}
        timer = rospy.Timer(rospy.Duration(PERIOD_S), self.publish)
        self.addCleanup(timer.shutdown)
        folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.start(generated(folder / "crawler"))
        self.start_sensor()

    def publish(self, _):
        for name, value in list(self.measured.items()):
            self.topics[name].publish(value)

    def start(self, package):
        paths = {
            "ROS_PACKAGE_PATH": f"{package.parent}:{os.environ['ROS_PACKAGE_PATH']}",
            "PYTHONPATH": f"{package / 'src'}:{os.environ['PYTHONPATH']}",
            "ROS_NAMESPACE": ROBOT,
        }
        launch = ["roslaunch", "--wait", package / "crawler.launch"]
        process = subprocess.Popen(launch, env={**os.environ, **paths}, stdin=subprocess.DEVNULL)
        self.addCleanup(process.wait, DEADLINE_S)
        self.addCleanup(process.send_signal, signal.SIGINT)

    def start_sensor(self):
        """Start the tilt sensor: a C++ node that no model knows."""
        command = ["rosrun", "topic_tools", "relay", "raw/tilt", "tilt/degrees", "__name:=tilt_sensor"]
        self.sensor = subprocess.Popen(command, env={**os.environ, "ROS_NAMESPACE": ROBOT})
        self.addCleanup(self.sensor.wait)
        self.addCleanup(self.sensor.kill)

    def runs(self, configuration):
        """Wait until a configuration runs, and the reasoner says so; return its decision."""
        decisions = self.listener.decisions
        told = lambda: [(d.to_configuration, d.state, d.explanation) for d in decisions]  # noqa: E731
        wait_for_equal(lambda: self.manipulator.running, configuration, told)
        wait_for(lambda: [d.to_configuration for d in decisions if d.state == "EXECUTED"][-1:] == [configuration], told)
        return decisions[-1]

    def test_design_suits_what_was_measured_last(self):
        self.runs("wheels")
        self.leaves_a_design_that_is_no_longer_suited()
        self.keeps_the_last_value_of_a_sensor_that_dies_and_of_an_observer_that_ends()
        self.takes_the_better_design_again()
        self.heeds_the_other_property_too()

    def leaves_a_design_that_is_no_longer_suited(self):
        self.measured["raw/tilt"] = -20.0
        decision = self.runs("tracks")
        self.assertEqual(decision.trigger, "environment:slope")
        self.assertEqual(decision.causes, ["slope 20 > 12, which wheels needs"])

    def keeps_the_last_value_of_a_sensor_that_dies_and_of_an_observer_that_ends(self):
        self.sensor.kill()
        self.listener.logged("QA slope can't be observed: last message on tilt/degrees")
        self.assertTrue(rospy.ServiceProxy(f"{ROBOT}/unload_observer", UnloadObserver)("SlopeObserver").ok)
        del self.measured["motor/current"]
        decision = self.runs("winch")
        lost = {candidate.name: candidate.lost_because for candidate in decision.candidates}
        self.assertEqual(lost["wheels"], "slope 20 > 12")

    def takes_the_better_design_again(self):
        self.measured["raw/tilt"] = 5.0
        self.start_sensor()
        self.assertTrue(rospy.ServiceProxy(f"{ROBOT}/load_observer", LoadObserver)("SlopeObserver").ok)
        self.assertIn("wheels can be deployed again", self.runs("wheels").causes)

    def heeds_the_other_property_too(self):
        self.measured["dust/density"] = 9.0
        decision = self.runs("winch")
        self.assertEqual((decision.trigger, decision.causes), ("environment:dust", ["dust 9 > 3, which wheels needs"]))


def generated(package):
    """Return the crawler's package with all that its models give, and with the formulas of its observers."""
    shutil.copytree(CRAWLER, package)
    subprocess.run(["rosmodel", "generate", "all", package / "models", "-o", package], check=True)
    for name, formula in FORMULAS.items():
        plugin = package / "src" / "crawler" / f"{name}_observer.py"
        written = re.sub(r"raise NotImplementedError\(.*", f"return self.status_of({formula})", plugin.read_text())
        plugin.write_text(written)
    return package


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "surroundings", SurroundingsTest)
