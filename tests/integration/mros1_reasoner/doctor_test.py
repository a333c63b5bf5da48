#!/usr/bin/env python3
"""A greenhouse in a namespace, looked at before its meta-controller starts: what is odd is told, and then no more."""

import os
import shutil
import signal
import subprocess
import tempfile
import unittest
from pathlib import Path

import rostest
from helpers.waiting import DEADLINE_S, wait_for

HERE = Path(__file__).resolve().parent
ROBOT = """<launch>
  <node pkg="greenhouse" type="driver.py" name="valve_driver"/>
  <node pkg="greenhouse" type="driver.py" name="pump_driver"/>
  <node pkg="greenhouse" type="watering.py" name="waterer" respawn="{respawn}">
    <param name="means" value="valve"/>
  </node>
</launch>"""


class DoctorTest(unittest.TestCase):
    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.copy = self.folder / "greenhouse"
        shutil.copytree(HERE / "greenhouse", self.copy)
        self.environment = {**os.environ, "ROS_PACKAGE_PATH": f"{self.folder}:{os.environ['ROS_PACKAGE_PATH']}"}

    def start(self, respawn):
        file = self.folder / f"robot_{respawn}.launch"
        file.write_text(ROBOT.format(respawn=respawn))
        own = {**self.environment, "ROS_NAMESPACE": "/north_wing"}
        process = subprocess.Popen(["roslaunch", "--wait", str(file)], env=own, stdin=subprocess.DEVNULL)
        self.addCleanup(self.end, process)
        return process

    def end(self, process):
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
            process.wait(DEADLINE_S)

    def look(self, namespace):
        command = ["rosmodel", "doctor", str(self.copy), "--namespace", namespace]
        done = subprocess.run(command, env=self.environment, check=False, capture_output=True, text=True)
        self.assertEqual(done.stderr, "")
        return done.returncode, done.stdout

    def wait_for_answer(self, namespace, fits, what):
        answers = []

        def look():
            answers.append(self.look(namespace))
            return fits(*answers[-1])

        wait_for(look, lambda: f"{what}: {answers[-1]}")
        return answers[-1][1]

    def test_what_is_odd_is_told_until_it_is_put_right(self):
        process = self.start("true")
        self.wait_for_answer(
            "/north_wing",
            lambda status, out: status == 1 and "/north_wing/waterer: variants bring this node, and roslaunch" in out,
            "the node that is started again",
        )
        status, out = self.look("/")
        self.assertEqual(status, 1)
        self.assertIn("export ROS_NAMESPACE=/north_wing", out)
        self.assertIn("are not generated yet", out)
        self.end(process)
        subprocess.run(["rosmodel", "generate", "all", self.copy / "models", "-o", self.copy], check=True)
        self.start("false")
        out = self.wait_for_answer(
            "/north_wing",
            lambda status, out: status == 0 and "note: /north_wing/waterer: " in out,
            "a greenhouse that fits, whose variants' node runs",
        )
        self.assertTrue(out.endswith("nothing found\n"))
        configuration = self.copy / "config" / "reasoner.yaml"
        configuration.write_text(configuration.read_text() + "calm: 1.0\n")
        status, out = self.look("/north_wing")
        self.assertEqual(status, 1)
        self.assertIn("config/reasoner.yaml: is older than the models", out)


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "doctor", DoctorTest)
