#!/usr/bin/env python3
"""Requests that cross each other or are taken back, at any moment."""

import random
import threading
import time
from unittest import mock

import actionlib
import rospy
import rostest
from actionlib.action_client import GoalManager
from actionlib_msgs.msg import GoalID, GoalStatus
from helpers.cases import case
from helpers.connections import reaches
from helpers.waiting import DEADLINE_S, wait_for
from integration.rosgraph_manipulator.manipulator_harness import CONFIGURATIONS, PairTest, pid_of
from metacontrol_msgs.msg import MvpReconfigurationAction, MvpReconfigurationGoal
from rosgraph_manipulator.ros import client


class RequestsTest(PairTest):
    # The manipulator publishes cmd_vel, and no node of the configuration does.
    configurations = {**CONFIGURATIONS, "mute": {**CONFIGURATIONS["fast"], "topics": ["wait/status", "cmd_vel"]}}
    manipulator_parameters = {"settle_time": 0.2, "probation": 0.0}

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.requests = actionlib.ActionClient("rosgraph_manipulator_action_server", MvpReconfigurationAction)
        assert cls.requests.wait_for_server(rospy.Duration(DEADLINE_S))

    def setUp(self):
        self.assertEqual(self.request("slow"), 1, self.manipulator.said())
        self.forget_goals()

    def restart_with(self, **parameters):
        for name, value in parameters.items():
            rospy.set_param(f"rosgraph_manipulator/{name}", value)
        self.manipulator.end()
        type(self).start_manipulator()
        wait_for(lambda: pid_of("/rosgraph_manipulator") == self.manipulator.pid, "the manipulator is there")
        # what was said before it heard us is lost, on either topic
        wait_for(self.is_heard, "it answers")
        wait_for(lambda: reaches(self.requests.pub_cancel, "/rosgraph_manipulator"), "it hears what is taken back")

    def is_heard(self):
        handle = self.ask("no_such_configuration")
        try:
            wait_for(lambda: handle.get_comm_state() == actionlib.CommState.DONE, "an answer", 1.0)
        except AssertionError:
            return False
        return True

    def ask(self, name):
        return self.requests.send_goal(MvpReconfigurationGoal(name))

    def take_back(self, handle):
        """Cancel a request. The handle's own cancel would have it wait for ever where the result is there already."""
        self.requests.pub_cancel.publish(GoalID(id=handle.comm_state_machine.action_goal.goal_id.id))

    @staticmethod
    def finish(handle):
        wait_for(lambda: handle.get_comm_state() == actionlib.CommState.DONE, "the request has a result")
        return handle.get_goal_status(), handle.get_result() and handle.get_result().result

    def test_configuration_without_its_topics_is_not_ready(self):
        self.restart_with(ready_timeout=15.0)
        self.addCleanup(self.restart_with, ready_timeout=30.0)
        self.assertEqual(self.request("mute"), 0)
        self.assertIn("not all of its topics are published", self.text)
        self.assertIn("/cmd_vel is missing", self.text)
        self.wait_for_state("slow")

    def test_answer_that_comes_while_the_command_still_sends_is_taken(self):
        send = GoalManager.init_goal

        def send_slowly(*arguments):
            handle = send(*arguments)
            self.finish(handle)
            return handle

        answers = []
        command = threading.Thread(target=lambda: answers.append(client.request("no_such_configuration")), daemon=True)
        with mock.patch.object(GoalManager, "init_goal", send_slowly):
            command.start()
            wait_for(lambda: answers, "the end of the command")
        self.assertEqual((answers[0].done, answers[0].result), (False, -1))

    def test_requests_wait_for_their_turn(self):
        self.restart_with(concurrency="wait")
        first, second = self.ask("fast"), self.ask("slow")
        self.assertEqual(self.finish(first), (GoalStatus.SUCCEEDED, 1))
        self.assertEqual(self.finish(second), (GoalStatus.SUCCEEDED, 1))
        self.wait_for_state("slow")

    def test_waiting_request_can_be_taken_back(self):
        self.restart_with(concurrency="wait")
        first, second = self.ask("fast"), self.ask("slow")
        self.take_back(second)
        self.assertEqual(self.finish(second)[1], 0)
        self.assertEqual(self.finish(first), (GoalStatus.SUCCEEDED, 1))
        self.wait_for_state("fast")

    def test_request_is_refused_while_another_one_runs(self):
        self.restart_with(concurrency="refuse")
        first = self.ask("hangs")  # until it is taken back
        self.wait_for_state("hangs", "RECONFIGURING")
        second = self.ask("fast")
        self.assertEqual(self.finish(second)[0], GoalStatus.REJECTED)
        self.take_back(first)
        self.assertEqual(self.finish(first), (GoalStatus.PREEMPTED, 0))
        self.wait_for_state("slow")

    def test_request_replaces_the_one_that_runs(self):
        self.restart_with(concurrency="replace")
        goal_id, _ = self.send_goal()
        hanging = self.ask("hangs")
        wait_for(lambda: self.launcher_state.configuration == "hangs", "it is being started")
        server = self.server
        better = self.ask("fast")
        self.assertEqual(self.finish(hanging), (GoalStatus.PREEMPTED, 0))
        self.assertEqual(self.finish(better), (GoalStatus.SUCCEEDED, 1))
        self.wait_for_goal(goal_id, server)

    def test_request_taken_back_at_any_moment_leaves_one_good_configuration(self):
        self.restart_with(concurrency="wait")
        goal_id, _ = self.send_goal()
        generator = random.Random(6)
        running = "slow"
        for number in range(5):
            wanted = "slow" if running == "fast" else "fast"
            handle = self.ask(wanted)
            time.sleep(generator.uniform(0.0, 1.2))
            self.take_back(handle)
            status, result = self.finish(handle)
            with case(number, status=status, result=result):
                # It is recalled where the server hears that it is taken back before it hears the request.
                self.assertIn(
                    (status, result),
                    [(GoalStatus.RECALLED, 0), (GoalStatus.PREEMPTED, 0), (GoalStatus.SUCCEEDED, 1)],
                )
                running = wanted if result == 1 else running
                self.wait_for_state(running)
                wait_for(lambda: pid_of("/wait_server"), "a server runs")
        wait_for(lambda: self.server_goals.get(goal_id) == GoalStatus.ACTIVE, "the goal is still at work")


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "manipulator_requests", RequestsTest)
