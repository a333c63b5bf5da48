#!/usr/bin/env python3
"""Two pick cells on one master, each with a meta-controller of its own: neither adapts to what happens to the other."""

import os
import signal
import unittest

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from helpers.waiting import wait_for
from metacontrol_msgs.msg import ActiveConfiguration, Decision
from reasoner_harness import node_pid

LOOKS = 20
"""Evaluations of a monitor in which a wrong decision would have shown."""


class Cell:
    """What a cell's meta-controller says."""

    def __init__(self, namespace):
        self.namespace, self.decisions, self.active, self.eye = namespace, [], [], []
        rospy.Subscriber(f"{namespace}/mros1_reasoner/decision", Decision, self.decisions.append, queue_size=100)
        rospy.Subscriber(
            f"{namespace}/rosgraph_manipulator/active_configuration", ActiveConfiguration, self.active.append
        )
        rospy.Subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics, queue_size=500)

    def _on_diagnostics(self, array):
        if array._connection_header["callerid"] == f"{self.namespace}/rosgraph_monitor":
            self.eye += [s for s in array.status if (s.name, s.message) == ("eye", "Component status")]

    def runs(self, configuration):
        """Whether a configuration is deployed, as the manipulator says."""
        last = self.active[-1].functions if self.active else ()
        return [(f.configuration, f.state) for f in last] == [(configuration, "STABLE")]


class CellsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("cells_test")
        cls.cells = [Cell("/cell_1"), Cell("/cell_2")]

    def setUp(self):
        for cell in self.cells:
            wait_for(lambda cell=cell: cell.active and cell.active[-1].functions, f"{cell.namespace} picks")
            wait_for(lambda cell=cell: cell.eye, f"{cell.namespace}'s monitor looks")
            cell.decisions.clear()

    def look_again(self):
        """Wait for more looks of both monitors."""
        for cell in self.cells:
            seen = len(cell.eye)
            wait_for(lambda cell=cell, seen=seen: len(cell.eye) >= seen + LOOKS, f"{cell.namespace}: more looks")

    def test_death_of_a_driver_makes_its_own_cell_adapt_once_and_no_other(self):
        one, two = self.cells
        for cell in (one, two):
            wait_for(lambda cell=cell: cell.runs("picks_by_eye"), f"{cell.namespace} picks by eye")
        os.kill(node_pid("/cell_1/eye"), signal.SIGKILL)
        wait_for(lambda: one.runs("picks_by_touch"), "cell_1 picks by touch")
        wait_for(lambda: [d for d in one.decisions if d.state == "EXECUTED"], "an executed decision of cell_1")
        self.assertEqual(rospy.get_param("/cell_1/picker/mode"), "touch")
        self.look_again()
        self.assertEqual({s.hardware_id for s in one.eye}, {"robot:/cell_1"})
        self.assertEqual(len({d.id for d in one.decisions}), 1, [d.explanation for d in one.decisions])
        self.assertEqual([d.explanation for d in two.decisions], [])
        self.assertTrue(two.runs("picks_by_eye"))
        self.assertEqual(rospy.get_param("/cell_2/picker/mode"), "eye")

    def test_hung_node_of_a_cell_is_restarted_there_once(self):
        one, two = self.cells
        wait_for(lambda: two.runs("picks_by_eye"), "cell_2 picks by eye")
        hung = node_pid("/cell_2/picker")
        os.kill(hung, signal.SIGSTOP)
        wait_for(lambda: [d for d in two.decisions if d.state == "EXECUTED"], "an executed decision of cell_2")
        self.assertNotEqual(node_pid("/cell_2/picker"), hung)
        self.look_again()
        wait_for(lambda: two.runs("picks_by_eye"), lambda: f"cell_2 picks by eye again, not {two.active[-1:]}")
        changes = {(d.trigger, d.from_configuration, d.to_configuration) for d in two.decisions}
        self.assertEqual(changes, {("component:picker", "picks_by_eye", "picks_by_eye")})
        self.assertEqual(len({d.id for d in two.decisions}), 1, [d.explanation for d in two.decisions])
        self.assertEqual([d.explanation for d in one.decisions], [])


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "cells", CellsTest)
