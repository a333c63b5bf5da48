#!/usr/bin/env python3
"""Somebody changes parameters of a station in a namespace, with three functions: the meta-controller puts them back."""

import threading

import rospy
import rostest
from helpers.waiting import wait_for, wait_for_equal
from station_harness import StationTest

FORCE, SIDE = "/plant/grasper/force", "/plant/looker/side"


class DriftTest(StationTest):
    namespace = "/plant"

    def test_parameters_are_put_back_until_somebody_sets_them_again_and_again(self):
        self.wait_for_configurations()
        wait_for_equal(lambda: (rospy.get_param(FORCE, None), rospy.get_param(SIDE, None)), (1, "left"), "parameters")
        before = self.pids("f_assemble", "f_grasp", "f_look")

        rospy.set_param(FORCE, 7)
        wait_for_equal(lambda: rospy.get_param(FORCE), 1, "the force is put back")
        wait_for(lambda: "EXECUTED" in self.states_of("grasper"), lambda: f"it is told: {self.decisions}")
        self.wait_until_told(f"grasp_fine is deployed by parameters; put back: {FORCE} (7, not 1)")

        rospy.delete_param(SIDE)
        wait_for_equal(lambda: rospy.get_param(SIDE, None), "left", "the side is put back")
        wait_for(lambda: "EXECUTED" in self.states_of("looker"), lambda: f"it is told: {self.decisions}")
        self.wait_until_told(f"look_left is deployed by parameters; put back: {SIDE} (not set, not left)")

        ended = threading.Event()
        self.addCleanup(ended.set)
        threading.Thread(target=self.disturb, args=(ended,), daemon=True).start()
        wait_for(lambda: "FAILED" in self.states_of("grasper"), lambda: f"it is given up: {self.decisions}")
        refusal = next(d for d in self.decisions if (d.state, d.trigger) == ("FAILED", "parameter:grasper"))
        self.assertIn("somebody sets them again and again", refusal.explanation)
        self.assertLessEqual(self.states_of("grasper").count("EXECUTED"), 3)
        self.wait_for_configurations()
        self.assertEqual(self.pids("f_assemble", "f_grasp", "f_look"), before)

    def wait_until_told(self, text):
        """Wait for words of the manipulator: they come on another topic than the decision."""
        wait_for(lambda: text in self.told, lambda: f"the manipulator has told {self.told}")

    def states_of(self, node):
        """Return the states of the decisions on parameters of a node."""
        return [decision.state for decision in self.decisions if decision.trigger == f"parameter:{node}"]

    @staticmethod
    def disturb(ended):
        """Set the force again whenever it is right."""
        while not ended.wait(0.05):
            if rospy.get_param(FORCE, None) == 1:
                rospy.set_param(FORCE, 7)


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "drift", DriftTest)
