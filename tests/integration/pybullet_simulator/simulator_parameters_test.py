#!/usr/bin/env python3
"""A node of the simulated robot that cannot start says why in one line, and ends with status 2."""

import subprocess
import unittest

import rospy
import rostest
from helpers.cases import case

DEADLINE_S = 150
REFUSED = (
    ("simulator", "_slip:=5", "/slip is 5: it must be a finite number, at least 0 and at most 0.1"),
    ("simulator", "_world:=/nowhere/hall.yaml", "/nowhere/hall.yaml: No such file or directory: check the path"),
    ("simulator", "_initial_pose_x:=99", "initial pose (99, -8) is off the floor"),
    ("rear_laser", "_seed:=-4", "/seed is -4: it must be a whole number, at least 0"),
    ("camera", "_range_max:=0.01", "/range_max is 0.01: it must be a finite number, at least 0.15"),
    ("camera", "_unplugged:=true", "its device is unplugged: delete parameter /start_5/unplugged to plug it in again"),
)


class SimulatorParametersTest(unittest.TestCase):
    def test_wrong_value_ends_the_start_with_one_line_that_names_it(self):
        for number, (node, argument, said) in enumerate(REFUSED):
            with case(node=node, argument=argument):
                # One name for each start: a name's parameters stay on the server.
                command = ["rosrun", "metacontrol_sim", node, argument, f"__name:=start_{number}"]
                done = subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE_S, check=False)
                lines = [line for line in done.stderr.splitlines() if "pybullet build" not in line]
                self.assertEqual((done.returncode, len(lines)), (2, 1), done.stderr)
                self.assertIn(f"/start_{number}: ", lines[0])
                self.assertIn(said, lines[0])


if __name__ == "__main__":
    rospy.init_node("simulator_parameters_test")
    rostest.rosrun("metacontrol_tests", "simulator_parameters_test", SimulatorParametersTest)
