#!/usr/bin/env python3
"""The manipulator against real processes: deploying, keeping the goal, rolling back, surviving its launcher."""

import os
import signal
import unittest

import actionlib
import rospy
import rostest
from actionlib.msg import TestAction, TestGoal
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from helpers.cases import case
from helpers.connections import reaches
from helpers.waiting import DEADLINE_S, wait_for
from integration.action_clients import SureActionClient
from integration.rosgraph_manipulator.manipulator_harness import is_alive, pid_of
from metacontrol_msgs.msg import (
    ActiveConfiguration,
    FunctionGrounding,
    MvpReconfigurationAction,
    MvpReconfigurationGoal,
)


class ManipulatorTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("manipulator_test")
        cls.active = FunctionGrounding()
        cls.statuses = []  # a server, as the header of its connection, and the states of its goals
        rospy.Subscriber("rosgraph_manipulator/active_configuration", ActiveConfiguration, cls.on_active)
        rospy.Subscriber("wait/status", GoalStatusArray, cls.on_status)
        cls.client = SureActionClient("rosgraph_manipulator_action_server", MvpReconfigurationAction)
        assert cls.client.wait_for_server(rospy.Duration(DEADLINE_S))

    @classmethod
    def on_active(cls, message):
        cls.active = message.functions[0]

    @classmethod
    def on_status(cls, message):
        goals = {entry.goal_id.id: entry.status for entry in message.status_list}
        cls.statuses.append((message._connection_header, goals))

    @property
    def server_goals(self):
        return self.statuses[-1][1] if self.statuses else {}

    def setUp(self):
        self.assertEqual(self.request("slow"), 1)

    def request(self, name):
        self.client.send_goal(MvpReconfigurationGoal(name))
        self.assertTrue(self.client.wait_for_result(rospy.Duration(DEADLINE_S)), f"no result for {name}")
        return self.client.get_result().result

    def change_to(self, name):
        """Deploy a configuration, and wait until its server has told its goals three times."""
        before = len(self.statuses)
        old = self.statuses[-1][0]
        self.assertEqual(self.request(name), 1)
        wait_for(
            lambda: sum(server is not old for server, _ in self.statuses[before:]) >= 3,
            "the new server tells its goals",
        )

    def is_stable(self, name):
        return self.active.configuration == name and self.active.state == "STABLE"

    def test_request_replaces_the_nodes_and_says_so(self):
        before = pid_of("/wait_server")
        self.assertEqual(self.request("fast"), 1)
        wait_for(lambda: self.is_stable("fast"), lambda: f"fast is stable, not {self.active}")
        self.assertEqual(self.active.function, "f_navigate")
        self.assertNotEqual(pid_of("/wait_server"), before)
        self.assertFalse(is_alive(before))
        self.assertEqual(rospy.get_param("/wait_server/period"), "fast")

    def test_keys_of_the_file_become_parameters_as_published(self):
        command = "roslaunch metacontrol_tests server.launch period:=fast"
        self.assertEqual(rospy.get_param("/configurations/fast/command"), command)
        self.assertEqual(rospy.get_param("/save_action"), "wait")

    def test_running_configuration_is_left_alone(self):
        before = pid_of("/wait_server")
        self.assertEqual(self.request("slow"), 1)
        self.assertEqual(pid_of("/wait_server"), before)

    def test_unknown_configuration_is_refused(self):
        self.assertEqual(self.request("no_such_configuration"), -1)
        self.assertIn("no_such_configuration", self.client.get_goal_status_text())

    def test_configuration_that_does_not_come_up_is_rolled_back(self):
        for name in ("exits", "malformed"):
            with case(name):
                self.assertEqual(self.request(name), 0)
                wait_for(lambda: self.is_stable("slow"), lambda: f"slow is restored, not {self.active}")
                self.assertIsNotNone(pid_of("/wait_server"))

    def test_pending_goal_reaches_the_new_server_with_its_id(self):
        client = actionlib.ActionClient("wait", TestAction)
        wait_for(lambda: self.is_reached(client), "the server is reached")
        handle = client.send_goal(TestGoal(0))
        goal_id = handle.comm_state_machine.action_goal.goal_id.id
        wait_for(lambda: self.server_goals.get(goal_id) == GoalStatus.ACTIVE, "the goal is active")
        self.change_to("fast")
        wait_for(lambda: self.server_goals.get(goal_id) == GoalStatus.ACTIVE, "the new server works at it")
        wait_for(lambda: self.is_reached(client), "the new server is reached")
        client.cancel_all_goals()
        wait_for(lambda: self.server_goals.get(goal_id) != GoalStatus.ACTIVE, "the goal is cancelled")

    @staticmethod
    def is_reached(client):
        """Whether the server that runs now gets what a client sends."""
        return reaches(client.pub_goal, "/wait_server") and reaches(client.pub_cancel, "/wait_server")

    def test_finished_goal_is_not_resurrected(self):
        client = SureActionClient("wait", TestAction)
        self.assertTrue(client.wait_for_server(rospy.Duration(DEADLINE_S)))
        wait_for(lambda: self.is_reached(client.action_client), "the server is reached")
        client.send_goal_and_wait(TestGoal(7), rospy.Duration(DEADLINE_S))
        self.assertEqual(client.get_result().result, 7)
        self.change_to("fast")
        self.assertEqual(self.server_goals, {})

    def test_killed_launcher_takes_its_nodes_along_and_brings_the_configuration_back(self):
        before = pid_of("/wait_server")
        os.kill(pid_of("/rosgraph_launcher"), signal.SIGKILL)
        wait_for(lambda: not is_alive(before), "the launched node died with its launcher")
        wait_for(lambda: (pid_of("/wait_server") or before) != before, "the node was started again")
        wait_for(lambda: self.is_stable("slow"), lambda: f"slow is stable again, not {self.active}")


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "manipulator", ManipulatorTest)
