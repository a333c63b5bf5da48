#!/usr/bin/env python3
"""The relay before an unmodified server: its clients see one goal, at work from the beginning to the end."""

import subprocess
import sys

import actionlib
import rospy
import rostest
from actionlib.msg import TestAction, TestGoal
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from helpers.waiting import DEADLINE_S, wait_for
from integration.rosgraph_manipulator.manipulator_harness import CONFIGURATIONS, PairTest, configuration, pid_of
from std_msgs.msg import Empty

SCRIPT = """
import actionlib, rospy
from actionlib.msg import TestAction, TestGoal
rospy.init_node("script")
client = actionlib.ActionClient("asked", TestAction)
client.wait_for_server()
goal = client.send_goal(TestGoal(0))
rospy.spin()
"""


class RelayTest(PairTest):
    configurations = {
        **CONFIGURATIONS,
        "asks_slow": configuration(period="slow", args="--passes-on asked"),
        "asks_fast": configuration(period="fast", args="--passes-on asked"),
    }
    manipulator_parameters = {"save_action": "", "settle_time": 0.2, "probation": 0.0}

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.seen = []  # (goal, state) as clients are told
        rospy.Subscriber("asked/status", GoalStatusArray, cls.on_outer_status)
        cls.outer = actionlib.ActionClient("asked", TestAction)
        assert cls.outer.wait_for_server(rospy.Duration(DEADLINE_S))

    @classmethod
    def on_outer_status(cls, message):
        cls.seen += [(entry.goal_id.id, entry.status) for entry in message.status_list]

    def setUp(self):
        self.assertEqual(self.request("slow"), 1, self.manipulator.said())

    def at_work(self):
        return [goal for goal, status in self.server_goals.items() if status == GoalStatus.ACTIVE]

    def test_goal_goes_on_over_changes_and_deaths_of_its_server(self):
        handle = self.outer.send_goal(TestGoal(0))
        goal_id = handle.comm_state_machine.action_goal.goal_id.id
        wait_for(lambda: len(self.at_work()) == 1, "the server has the goal")
        for name in ("fast", "slow"):
            server = self.server
            self.assertEqual(self.request(name), 1)
            wait_for(lambda: self.server is not server and len(self.at_work()) == 1, "the next server has the goal")  # noqa: B023
        self.assertEqual({state for goal, state in self.seen if goal == goal_id}, {GoalStatus.ACTIVE})
        handle.cancel()
        wait_for(lambda: handle.get_comm_state() == actionlib.CommState.DONE, "the goal is taken back")
        self.assertEqual(handle.get_goal_status(), GoalStatus.PREEMPTED)
        wait_for(lambda: not self.at_work(), "the server has dropped it")

    def test_goal_of_a_client_that_is_gone_ends_with_its_server(self):
        script = subprocess.Popen([sys.executable, "-c", SCRIPT])
        self.addCleanup(script.kill)
        self.addCleanup(script.wait, DEADLINE_S)
        wait_for(lambda: len(self.at_work()) == 1, "the server has the goal")
        active = GoalStatus.ACTIVE
        goals = wait_for(
            lambda: {g for g, state in self.seen if g.startswith("/script") and state == active}, "its goal"
        )
        script.kill()
        script.wait(DEADLINE_S)
        server = self.server
        self.assertEqual(self.request("fast"), 1)
        wait_for(lambda: {(goal, GoalStatus.PREEMPTED) for goal in goals} & set(self.seen), "its goal has ended")
        wait_for(lambda: self.server is not server, "the next server is there")
        self.assertEqual(self.at_work(), [])

    def test_goal_that_the_server_sends_through_the_relay_to_itself_goes_on(self):
        self.assertEqual(self.request("asks_slow"), 1, self.text)
        publisher = rospy.Publisher("simple_goal", Empty, queue_size=1)
        wait_for(publisher.get_num_connections, "the server takes goals in another way")
        publisher.publish(Empty())
        wait_for(lambda: len(self.at_work()) == 1, "the server has the goal")
        own = wait_for(lambda: next((g for g, _ in self.seen if g.startswith("/wait_server")), None), "it is its own")
        server = self.server
        self.assertEqual(self.request("asks_fast"), 1, self.text)
        wait_for(lambda: self.server is not server and len(self.at_work()) == 1, "the next server has the goal")
        self.outer.cancel_all_goals()
        wait_for(lambda: (own, GoalStatus.PREEMPTED) in self.seen, "the goal is taken back")

    def test_results_are_passed_on(self):
        self.assertIsNotNone(pid_of("/action_relay"))
        handle = self.outer.send_goal(TestGoal(7))
        wait_for(lambda: handle.get_comm_state() == actionlib.CommState.DONE, "the goal has ended")
        self.assertEqual((handle.get_terminal_state(), handle.get_result().result), (GoalStatus.SUCCEEDED, 7))


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "manipulator_relay", RelayTest)
