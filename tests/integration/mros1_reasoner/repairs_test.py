#!/usr/bin/env python3
"""A greenhouse whose drivers jam and die: they are repaired in place, or while something else waters the plants."""

import os
import signal

import rosgraph
import rospy
import rostest
from generated_harness import GeneratedSystemTest
from helpers.waiting import wait_for, wait_for_equal
from reasoner_harness import node_pid
from std_srvs.srv import Empty


class RepairsTest(GeneratedSystemTest):
    package = "greenhouse"
    namespace = "/south_wing"

    def told_of(self, component):
        """Return the states of the decisions that one component has caused, and to which configuration they lead."""
        own = [d for d in self.decisions if d.trigger == f"component:{component}"]
        return [(d.state, d.from_configuration, d.to_configuration) for d in own]

    def failed(self, text):
        """Return the decisions that have failed and whose explanations hold a text."""
        return [d for d in self.decisions if d.state == "FAILED" and text in d.explanation]

    def wait_for_configuration(self, name):
        wait_for_equal(lambda: self.active, {"f_water": (name, "STABLE")}, "what waters")

    def pid(self, node):
        try:
            return node_pid(self.name(node))
        except (OSError, rosgraph.MasterException):  # it is dead, or not there yet
            return None

    def jam(self, driver):
        rospy.wait_for_service(self.name(f"{driver}/jam"))
        rospy.ServiceProxy(self.name(f"{driver}/jam"), Empty)()

    def test_jammed_valve_is_reset_while_the_same_design_goes_on(self):
        self.wait_for_configuration("drip")
        before = self.pid("waterer")
        self.jam("valve_driver")
        in_place = "drip", "drip"
        wait_for_equal(lambda: self.told_of("valve"), [("DECIDED", *in_place), ("EXECUTED", *in_place)], "the repair")
        self.assertIn("valve is repaired first", self.decisions[-1].explanation)
        self.assertEqual(self.pid("waterer"), before)
        self.wait_for_configuration("drip")

    def test_valve_that_is_stuck_fast_makes_way_for_the_sprinklers_until_somebody_frees_it(self):
        rospy.set_param(self.name("valve_driver/resets"), 0)
        self.wait_for_configuration("drip")
        self.jam("valve_driver")
        self.wait_for_configuration("sprinkle")
        failed = wait_for(lambda: self.failed("valve is repaired"), lambda: f"it is told: {self.decisions}")[0]
        self.assertIn("it is stuck fast", failed.explanation)
        rospy.ServiceProxy(self.name("valve_driver/free"), Empty)()
        self.wait_for_configuration("drip")

    def test_dead_driver_is_started_again_beside_what_runs(self):
        self.wait_for_configuration("drip")
        wait_for(lambda: self.pid("pump_driver"), "the pump's driver runs")
        dead = self.pid("pump_driver")
        os.kill(dead, signal.SIGKILL)
        wait_for(lambda: self.pid("pump_driver") not in (None, dead), "the pump's driver is started again")
        beside = "drip", "drip"
        wait_for_equal(lambda: self.told_of("pump"), [("DECIDED", *beside), ("EXECUTED", *beside)], "the repair")
        self.assertIn("pump is repaired (attempt 1 of 2) while drip runs", self.decisions[-1].explanation)
        self.assertEqual(self.active, {"f_water": ("drip", "STABLE")})


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "repairs", RepairsTest)
