#!/usr/bin/env python3
"""The example of a cell that picks parts: it picks on when nodes in Python and C++ die, and when it is dark."""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from xmlrpc.client import ServerProxy

import rosgraph
import rospy
import rostest
from helpers.waiting import DEADLINE_S, wait_for
from metacontrol_msgs.msg import ActiveConfiguration, Decision
from std_msgs.msg import Float32, UInt32

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "pick_cell"
PARTS = 3
"""That many more parts have to be picked until the cell counts as one that works."""


def build(folder):
    """Build the example as a user's workspace beside ours; return the environment of its nodes."""
    (folder / "src").mkdir()
    (folder / "src" / EXAMPLE.name).symlink_to(EXAMPLE)
    python = f"-DPYTHON_EXECUTABLE={sys.executable}"
    subprocess.run(["catkin_make", "-C", str(folder), python], check=True, timeout=2 * DEADLINE_S)
    words = ["bash", "-c", f". {folder}/devel/setup.bash --extend && env -0"]
    pairs = subprocess.run(words, check=True, capture_output=True, text=True).stdout.split("\0")
    return dict(pair.split("=", 1) for pair in pairs if pair)


def process_of(node):
    """Return the process of a node that runs, 0 where none answers."""
    try:
        return ServerProxy(rosgraph.Master("/test").lookupNode(node)).getPid("/test")[2]
    except (OSError, rosgraph.MasterException):
        return 0


class PickCellTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("pick_cell_test")
        folder = Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, folder)
        cls.environment = build(folder)

    def setUp(self):
        self.decisions, self.active, self.picked = [], {}, 0
        self.heard = [
            rospy.Subscriber("/mros1_reasoner/decision", Decision, self.decisions.append, queue_size=100),
            rospy.Subscriber("/rosgraph_manipulator/active_configuration", ActiveConfiguration, self.take_active),
            rospy.Subscriber("/picked", UInt32, self.take_picked, queue_size=100),
        ]
        for file in ("metacontrol.launch", "robot.launch"):
            words = ["roslaunch", "--wait", "pick_cell", file]
            process = subprocess.Popen(words, env=self.environment, stdin=subprocess.DEVNULL)
            self.addCleanup(process.wait, DEADLINE_S)
            self.addCleanup(process.send_signal, signal.SIGINT)
        for subscriber in self.heard:
            self.addCleanup(subscriber.unregister)
        self.wait_for_active("sharp", "swift")
        self.wait_for_picks()

    def take_active(self, message):
        self.active = {f.function: f.configuration for f in message.functions if f.state == "STABLE"}

    def take_picked(self, message):
        self.picked += message.data > 0

    def wait_for_active(self, detect, pick):
        wanted = {"f_detect": detect, "f_pick": pick}
        wait_for(lambda: self.active == wanted, lambda: f"{wanted} runs, not {self.active}")

    def wait_for_picks(self):
        self.picked = 0
        wait_for(lambda: self.picked >= PARTS, "parts are picked")

    def wait_for_decision(self, trigger):
        """Wait until a decision by a trigger is carried out; return it."""

        def executed():
            return next((d for d in self.decisions if d.state == "EXECUTED" and trigger in d.trigger), None)

        return wait_for(executed, lambda: f"executed by {trigger}: {[(d.trigger, d.state) for d in self.decisions]}")

    def kill(self, node):
        """Kill the process of a node; return it."""
        process = wait_for(lambda: process_of(node), f"{node} answers")
        os.kill(process, signal.SIGKILL)
        return process

    def test_dead_gripper_is_repaired_and_a_detector_that_dies_again_and_again_replaced(self):
        dead = self.kill("/gripper")
        repaired = self.wait_for_decision("component:gripper")
        self.assertEqual(repaired.to_configuration, "swift")
        wait_for(lambda: process_of("/gripper") not in (0, dead), "another gripper runs")
        self.wait_for_picks()
        wait_for(self.kill_sharp_detector, "the coarse detector is deployed")
        replaced = self.wait_for_decision("sharp")
        self.assertEqual((replaced.from_configuration, replaced.to_configuration), ("sharp", "coarse"))
        self.wait_for_picks()
        self.assertEqual(self.active, {"f_detect": "coarse", "f_pick": "swift"})

    def kill_sharp_detector(self):
        """Kill the sharp detector if it runs; return whether the coarse one is deployed."""
        process = process_of("/detector")
        with contextlib.suppress(ProcessLookupError, FileNotFoundError):
            if process and b"sharp_detector" in Path(f"/proc/{process}/cmdline").read_bytes():
                os.kill(process, signal.SIGKILL)
        return self.active.get("f_detect") == "coarse"

    def test_coarse_detector_takes_over_in_the_dark(self):
        lamp = rospy.Publisher("/lamp", Float32, queue_size=1, latch=True)
        self.addCleanup(lamp.unregister)
        lamp.publish(0.3)
        self.assertEqual(self.wait_for_decision("found").to_configuration, "coarse")
        self.wait_for_active("coarse", "swift")
        self.wait_for_picks()


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "pick_cell", PickCellTest)
