#!/usr/bin/env python3
"""Nodes that exit, die, hang or do not end: what ran before is restored with the reason, where it must be."""

import os
import signal
from pathlib import Path

import rospy
import rostest
from helpers.cases import case
from helpers.waiting import wait_for
from integration.rosgraph_manipulator.manipulator_harness import PairTest, is_alive, pid_of


class FailingNodesTest(PairTest):
    manipulator_parameters = {"ready_timeout": 20.0, "settle_time": 2.0, "probation": 100.0}
    launcher_parameters = {"shutdown_timeout": 1.0, "sigint_timeout": 0.5}

    def setUp(self):
        self.assertEqual(self.request("slow"), 1, self.manipulator.said())

    def test_nodes_that_exit_early_are_rolled_back_with_the_reason(self):
        for name, words in (("exits", "ended with status 1"), ("dies", "ended with status 3")):
            with case(name):
                self.assertEqual(self.request(name), 0)
                self.assertIn(words, self.text)
                self.assertIn("slow was restored", self.text)
                self.wait_for_state("slow")
                self.assertIsNotNone(pid_of("/wait_server"))

    def test_node_that_dies_soon_after_the_result_is_rolled_back_too(self):
        self.assertEqual(self.request("fast"), 1)
        os.kill(pid_of("/wait_server"), signal.SIGKILL)
        self.wait_for_state("slow")
        self.assertIsNotNone(pid_of("/wait_server"))

    def test_node_that_hangs_at_its_start_is_rolled_back(self):
        self.assertEqual(self.request("hangs"), 0)
        self.assertIn("/wait_server is not up within 20 s", self.text)
        self.wait_for_state("slow")

    def test_node_that_ignores_every_request_to_end_is_killed(self):
        self.assertEqual(self.request("stubborn"), 1)
        stubborn = pid_of("/wait_server")
        self.assertEqual(self.request("slow"), 1)
        self.assertFalse(is_alive(stubborn))
        self.assertNotEqual(pid_of("/wait_server"), stubborn)

    def test_node_that_has_done_its_work_may_end(self):
        self.assertEqual(self.request("once"), 1, self.text)
        wait_for(lambda: self.launcher_state.nodes == ["/wait_server"], "the node has finished")
        self.wait_for_state("once")
        self.assertTrue(rospy.get_param("once_done"))


if __name__ == "__main__":
    os.chdir(Path(__file__).parent)
    rostest.rosrun("metacontrol_tests", "manipulator_failing_nodes", FailingNodesTest)
