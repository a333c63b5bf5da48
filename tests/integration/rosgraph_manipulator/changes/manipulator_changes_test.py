#!/usr/bin/env python3
"""Changes in heaps; parameters set at running nodes; standby; the commands."""

import itertools
import os
import random
import subprocess
import threading

import psutil
import rospy
import rostest
from actionlib.msg import TestActionGoal, TestGoal
from actionlib_msgs.msg import GoalID, GoalStatus
from dynamic_reconfigure.msg import Config
from helpers.cases import case
from helpers.waiting import DEADLINE_S, wait_for, wait_for_equal
from integration.rosgraph_manipulator.manipulator_harness import PairTest, is_alive, pid_of, words_of
from rosgraph_launcher.launching.options import LauncherOptions

RANDOM_REQUESTS = int(os.environ.get("MROS_RANDOM_REQUESTS", "10"))  # the benchmark makes 200


class ChangesTest(PairTest):
    manipulator_parameters = {"settle_time": 0.5, "probation": 0.0}
    launcher_parameters = {"standby": True}

    def setUp(self):
        self.assertEqual(self.request("slow"), 1, self.manipulator.said())
        self.forget_goals()

    def test_many_random_requests_leave_nothing_behind_and_lose_no_goal(self):
        goal_id, _ = self.send_goal()
        generator = random.Random(200)
        names = [
            "slow",
            "fast",
            "tuned_1",
            "tuned_2",
            "once",
            "exits",
            "dies_at_once",
            "malformed",
            "no_node",
            "unknown",
        ]
        expected = {"exits": 0, "dies_at_once": 0, "malformed": 0, "no_node": 0, "unknown": -1}
        usage = []
        for number in range(RANDOM_REQUESTS):
            name = generator.choice(names)
            with case(number, name=name):
                self.assertEqual(self.request(name), expected.get(name, 1), self.text)
            wait_for(lambda: self.state.state == "STABLE", lambda: f"a configuration is stable: {self.state}")
            usage.append(self.usage())
        wait_for(lambda: self.server_goals.get(goal_id) == GoalStatus.ACTIVE, "the goal is still at work")
        wait_for(self.has_only_standby, lambda: f"nothing but the standby is left: {self.launched()}")
        descriptors, memory = zip(*usage[len(usage) // 3 :], strict=True)
        self.assertLess(max(descriptors) - min(descriptors), 30, usage)
        self.assertLess(memory[-1] - memory[0], 20e6 + 0.05e6 * RANDOM_REQUESTS, usage)

    def has_only_standby(self):
        """Whether at most one process for each node that runs, and some for others, are left beside the nodes."""
        nodes = self.launcher_state.nodes
        most = len(nodes) + LauncherOptions("").standby_others
        return len(set(self.launched()) - {pid_of(node) for node in nodes}) <= most

    def usage(self):
        pair = [psutil.Process(node.pid) for node in (self.launcher, self.manipulator)]
        return sum(process.num_fds() for process in pair), sum(process.memory_info().rss for process in pair)

    def goal_publisher(self):
        """A publisher of goals that server and manipulator hear."""
        publisher = rospy.Publisher("wait/goal", TestActionGoal, queue_size=10)
        self.addCleanup(publisher.unregister)
        for node in ("/wait_server", "/rosgraph_manipulator"):
            wait_for(lambda: publisher.impl.has_connection(node), f"{node} listens")  # noqa: B023
        return publisher

    def test_goal_is_kept_though_newer_ones_come_all_the_time_and_are_rejected(self):
        goal_id, _ = self.send_goal()
        publisher, over = self.goal_publisher(), threading.Event()

        def flood():
            numbers = itertools.count()
            while not over.wait(0.02):
                publisher.publish(TestActionGoal(goal_id=GoalID(id=f"odd {next(numbers)}"), goal=TestGoal(-1)))

        thread = threading.Thread(target=flood)
        thread.start()
        self.addCleanup(thread.join)
        self.addCleanup(over.set)
        wait_for(lambda: GoalStatus.REJECTED in self.server_goals.values(), "they are rejected")
        old = self.server
        self.assertEqual(self.request("fast"), 1, self.text)
        self.wait_for_goal(goal_id, old)

    def test_goal_is_kept_though_the_server_has_rejected_newer_ones(self):
        goal_id, _ = self.send_goal()
        publisher = self.goal_publisher()
        for name in ("", "odd", ""):
            publisher.publish(TestActionGoal(goal_id=GoalID(id=name), goal=TestGoal(-1)))
        wait_for(lambda: [*self.server_goals.values()].count(GoalStatus.REJECTED) == 3, "they are rejected")
        old = self.server
        self.assertEqual(self.request("fast"), 1, self.text)
        self.wait_for_goal(goal_id, old)

    def test_parameters_are_set_while_the_nodes_run(self):
        self.assertEqual(self.request("tuned_1"), 1)
        pids = pid_of("/tunable"), pid_of("/wait_server")
        wait_for_equal(self.updates, 1.0, "the server is there")
        self.assertEqual(self.request("tuned_2"), 1)
        wait_for(lambda: self.states[-1].tactic == "parameters", "the tactic is told")
        self.assertEqual((pid_of("/tunable"), pid_of("/wait_server")), pids)
        self.assertEqual(self.updates(), 2.0)
        self.assertEqual(rospy.get_param("/tunable/controller_frequency"), 2.0)

    def test_value_out_of_the_nodes_bounds_restarts_it_alone(self):
        self.assertEqual(self.request("tuned_1"), 1)
        tunable, server = pid_of("/tunable"), pid_of("/wait_server")
        self.assertEqual(self.request("tuned_wrong"), 1)
        wait_for(lambda: self.states[-1].tactic == "restart", "the tactic is told")
        self.assertEqual(pid_of("/wait_server"), server)
        self.assertNotEqual(pid_of("/tunable"), tunable)

    def test_parameter_that_no_server_has_restarts_its_node_alone(self):
        self.assertEqual(self.request("tuned_1"), 1)
        tunable, server = pid_of("/tunable"), pid_of("/wait_server")
        self.assertEqual(self.request("tuned_other"), 1)
        self.assertEqual(pid_of("/wait_server"), server)
        self.assertFalse(is_alive(tunable))

    def test_waiting_process_takes_the_next_variants_role(self):
        def waiting():
            server = pid_of("/wait_server")
            return {pid for pid in self.launched() if words_of(pid) == words_of(server)} - {server}

        standby = wait_for(waiting, "a process stands by")
        self.assertEqual(self.request("fast"), 1)
        self.assertIn(pid_of("/wait_server"), standby)
        self.assertEqual(rospy.get_param("/wait_server/period"), "fast")
        wait_for(lambda: waiting() - standby, "another process stands by")

    def test_commands_ask_and_tell(self):
        self.assertEqual(self.run_command("request", "fast")[0], 0)
        status, output = self.run_command("status")
        self.assertEqual(status, 0)
        self.assertIn("f_wait: fast STABLE", output)
        self.assertIn("/wait_server", output)
        self.assertRegex(output, r"total +\d+\.\d+ s")
        status, output = self.run_command("plan", "fast", "slow")
        self.assertEqual((status, output.split("\n")[0]), (0, "restart"))
        self.assertEqual(self.run_command("request", "no_such_configuration")[0], 2)

    @staticmethod
    def run_command(*words):
        done = subprocess.run(
            ["/usr/bin/rosrun", "rosgraph_manipulator", *words],
            capture_output=True,
            text=True,
            timeout=DEADLINE_S,
            check=False,
        )
        return done.returncode, done.stdout

    @staticmethod
    def updates():
        message = rospy.wait_for_message("/tunable/parameter_updates", Config, DEADLINE_S)
        return next(entry.value for entry in message.doubles if entry.name == "controller_frequency")


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "manipulator_changes", ChangesTest)
