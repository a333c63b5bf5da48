#!/usr/bin/env python3
"""Scripts in a cell that ask a gripper to do something, and end before it has: their goals end with its server."""

import os
import signal
import subprocess
import sys

import actionlib
import rospy
import rostest
from actionlib.msg import TestAction
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from helpers.connections import reaches
from helpers.waiting import DEADLINE_S, wait_for
from integration.rosgraph_manipulator.manipulator_harness import HERE, PairTest, pid_of
from std_msgs.msg import Empty

GRIPPER, ACTION = "/cell/arm/gripper", "/cell/arm/wait"
SCRIPT = """
import actionlib, rospy, sys
from actionlib.msg import TestAction, TestGoal
rospy.init_node("script")
client = actionlib.ActionClient("arm/wait", TestAction)
client.wait_for_server()
while not client.pub_goal.impl.has_connection("/rosgraph_manipulator"):  # it may connect after the server
    rospy.sleep(0.01)
goal = client.send_goal(TestGoal(0))
sys.stdin.readline()  # until it is told to make no use of its client any more
client.stop()
rospy.spin()
"""


def pick(force, *args):
    return {"function": "f_pick", "launch": str(HERE / "cell_pick.launch"), "args": [f"force:={force}", *args]}


class ClientsTest(PairTest):
    configurations = {
        "softly": pick(1),
        "hard": pick(9),
        "softly_on_its_own": pick(1, "args:=--passes-on wait"),
        "hard_on_its_own": pick(9, "args:=--passes-on wait"),
        "softly_with_foreman": pick(1, "foreman:=true"),
        "hard_with_foreman": pick(9, "foreman:=true"),
    }
    manipulator_parameters = {
        "save_action": "",
        "goal_msg_type": "",
        "functions": {"f_pick": {"save_action": ACTION, "goal_msg_type": "actionlib/TestAction"}},
        "initial_configuration": "softly",
        "settle_time": 0.2,
        "probation": 0.0,
    }
    launcher_parameters = {"restart_intensity": 1000}

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.waiting = actionlib.ActionClient(ACTION, TestAction)
        cls.subscribers.append(rospy.Subscriber(f"{ACTION}/status", GoalStatusArray, cls.on_status))

    def setUp(self):
        self.assertEqual(self.request("softly"), 1, self.manipulator.said())
        self.forget_goals()
        wait_for(lambda: not rospy.has_param(f"{ACTION}/resume_goal"), "no goal is kept")

    def start_script(self):
        """Start a script, and wait until its goal is at work."""
        before = set(self.server_goals)
        script = subprocess.Popen(
            [sys.executable, "-c", SCRIPT],
            env={**os.environ, "ROS_NAMESPACE": "/cell"},
            stdin=subprocess.PIPE,
        )
        self.addCleanup(script.wait, DEADLINE_S)
        self.addCleanup(script.stdin.close)
        self.addCleanup(script.kill)
        goal_id = wait_for(lambda: self.newest(before), "its goal is at work")
        wait_for(lambda: "client" in rospy.get_param(f"{ACTION}/resume_goal", {}), "its goal is kept")
        return script, goal_id

    def newest(self, before):
        active = (goal for goal, state in self.server_goals.items() if state == GoalStatus.ACTIVE)
        return next((goal for goal in active if goal not in before), None)

    def ask_on(self, topic):
        """Send a message that a node of the cell makes a goal of; return its id as soon as it is kept."""
        before = set(self.server_goals)
        publisher = rospy.Publisher(topic, Empty, queue_size=1)
        self.addCleanup(publisher.unregister)
        wait_for(publisher.get_num_connections, f"somebody listens on {topic}")
        publisher.publish(Empty())
        goal_id = wait_for(lambda: self.newest(before), "its goal is at work")
        wait_for(lambda: rospy.has_param(f"{ACTION}/resume_goal"), "its goal is kept")
        return goal_id

    def kill_server(self):
        """Kill the gripper, and wait until another one is in its place."""
        recoveries = len(self.recoveries())
        os.kill(wait_for(lambda: pid_of(GRIPPER), "it runs"), signal.SIGKILL)
        wait_for(lambda: len(self.recoveries()) > recoveries, "it recovers")

    def recoveries(self):
        return [state for state in self.states if state.tactic == "recovery"]

    def assert_dropped(self, goal_id, reason):
        """Assert that the present server gets other goals, and has not got that one before."""
        self.assertIn(f"goal {goal_id} is not sent to the next server: {reason}", self.manipulator.said())
        wait_for(lambda: reaches(self.waiting.pub_goal, GRIPPER), "the present server hears goals")
        own, handle = self.send_goal()
        self.assertEqual(set(self.server_goals), {own})
        handle.cancel()

    def test_goal_of_a_script_that_was_killed_ends_with_the_server(self):
        script, goal_id = self.start_script()
        script.kill()
        script.wait(DEADLINE_S)
        self.kill_server()
        self.assert_dropped(goal_id, "its client /cell/script has ended")

    def test_goal_of_a_script_that_has_dropped_its_client_ends_with_the_server(self):
        script, goal_id = self.start_script()
        script.stdin.write(b"stop\n")
        script.stdin.flush()
        master = rospy.get_master()
        wait_for(
            lambda: all(
                "/cell/script" not in nodes for topic, nodes in master.getSystemState()[2][1] if ACTION in topic
            ),
            "its client is gone",
        )
        self.assertEqual(self.request("hard"), 1, self.text)  # the same holds for a change that somebody asks for
        self.assert_dropped(goal_id, "its client /cell/script does not listen to the action any more")

    def test_goal_of_a_script_that_was_started_anew_gives_way_to_its_next_goal(self):
        script, _ = self.start_script()
        script.kill()
        script.wait(DEADLINE_S)
        _, second = self.start_script()
        self.kill_server()
        wait_for(lambda: self.server_goals == {second: GoalStatus.ACTIVE}, lambda: f"{second}, not {self.server_goals}")
        self.assertNotIn(f"goal {second} is not sent", self.manipulator.said())

    def test_goal_whose_server_dies_with_it_again_and_again_is_given_up(self):
        _, goal_id = self.start_script()  # it goes on listening, though its goal is lost for it
        for _ in range(3):
            self.kill_server()
            wait_for(lambda: goal_id in self.server_goals, "the next server has the goal")
        self.kill_server()
        self.assert_dropped(goal_id, "its server has died 4 times")

    def test_goal_that_the_server_sends_itself_goes_on_at_the_next_server(self):
        self.assertEqual(self.request("softly_on_its_own"), 1, self.text)
        goal_id = self.ask_on("/cell/arm/simple_goal")
        self.assertIn(f"{GRIPPER}-", goal_id)  # it is by the server's own client
        self.assertEqual(self.request("hard_on_its_own"), 1, self.text)
        wait_for(lambda: self.server_goals.get(goal_id) == GoalStatus.ACTIVE, "the next server has the goal")
        self.kill_server()
        wait_for(lambda: self.server_goals.get(goal_id) == GoalStatus.ACTIVE, "the one after a death has it, too")

    def test_goal_of_a_node_that_the_change_stops_too_ends_with_the_server(self):
        self.assertEqual(self.request("softly_with_foreman"), 1, self.text)
        goal_id = self.ask_on("/cell/ask")
        self.assertEqual(self.request("hard_with_foreman"), 1, self.text)
        self.assert_dropped(goal_id, "its client /cell/foreman ends, too")


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "manipulator_clients", ClientsTest)
