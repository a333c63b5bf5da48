#!/usr/bin/env python3
"""An assembly station: assembling needs grasping, which needs looking; each level breaks and is repaired."""

import contextlib
import os
import signal

import rospy
import rostest
from helpers.waiting import wait_for, wait_for_equal
from metacontrol_msgs.srv import AddObjective, RemoveObjective
from reasoner_harness import node_pid
from station_harness import PARTS, StationTest


class HierarchyTest(StationTest):
    def executed(self):
        return [decision.to_configuration for decision in self.decisions if decision.state == "EXECUTED"]

    def kill(self, node, how=signal.SIGKILL):
        pid = node_pid(node)
        os.kill(pid, how)
        return pid

    def test_each_level_is_deployed_repaired_and_released(self):
        self.wait_for_configurations()
        wait_for_equal(self.executed, ["look_left", "grasp_fine", "screw"], "the deepest requirement comes first")

        above = self.pids("f_assemble", "f_grasp")
        self.kill("/eye_left")  # the lowest level: its driver is gone
        self.wait_for_configurations(f_look="look_right")
        self.assertEqual(self.pids("f_assemble", "f_grasp"), above)

        others = self.pids("f_assemble", "f_look")
        hung = self.kill("/grasper", signal.SIGSTOP)  # the middle: its node hangs
        wait_for(lambda: self.answers("/grasper") not in (None, hung), "the grasper is restarted")
        self.wait_for_configurations(f_look="look_right")
        self.assertEqual(self.pids("f_assemble", "f_look"), others)

        wait_for(self.is_given_up, lambda: f"the middle, whose node dies again and again, gives up: {self.active}")
        self.wait_for_configurations(f_look="look_right", f_grasp="grasp_rough")
        self.assertEqual(self.pids("f_assemble", "f_look"), others)
        self.assertEqual(rospy.get_param("/grasper/force"), 9)

        below = self.pids("f_grasp", "f_look")
        self.kill("/screwdriver")  # the top
        self.wait_for_configurations(f_look="look_right", f_grasp="grasp_rough", f_assemble="glue")
        self.assertEqual(self.pids("f_grasp", "f_look"), below)

        remove = rospy.ServiceProxy("reasoner/remove_objective", RemoveObjective)
        wait_for(lambda: remove("o_assemble").ok, "the reasoner knows, too, that the adaptation has ended")
        wait_for_equal(lambda: self.active, {}, "what runs without an objective")
        for node in PARTS.values():
            self.assertIsNone(self.answers(self.name(node)), node)
        answer = rospy.ServiceProxy("reasoner/add_objective", AddObjective)("o_look", "f_look", [])
        self.assertTrue(answer.ok, answer.message)
        wait_for_equal(lambda: self.active, {"f_look": ("look_right", "STABLE")}, "what the new objective needs")

    def is_given_up(self):
        """Kill the grasper where it runs; tell whether another configuration has taken its place."""
        if self.active["f_grasp"] == ("grasp_fine", "STABLE") and (pid := self.answers("/grasper")):
            with contextlib.suppress(ProcessLookupError):  # somebody else was faster
                os.kill(pid, signal.SIGKILL)
            wait_for(lambda: self.answers("/grasper") != pid, "it is gone")
        return self.active["f_grasp"][0] != "grasp_fine"

    @staticmethod
    def answers(node):
        """Process id of a node that answers, else None."""
        try:
            return node_pid(node)
        except Exception:
            return None


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "hierarchy", HierarchyTest)
