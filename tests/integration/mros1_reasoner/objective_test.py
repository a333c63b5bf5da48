#!/usr/bin/env python3
"""Tasks ask the reasoner of a hand for functions by its action; the reasoner is killed, and the clock starts late."""

import signal
import unittest

import actionlib
import rospy
import rostest
from actionlib_msgs.msg import GoalStatus
from helpers.robot_side import Diagnostics
from helpers.waiting import wait_for, wait_for_equal
from metacontrol_msgs.msg import ExpectedQA, ObjectiveAction, ObjectiveGoal
from metacontrol_msgs.srv import Feasible, RemoveObjective
from mros1_reasoner.ros.asking import Asking, Need, Standing
from reasoner_functions_test import SETTINGS, Manipulator
from reasoner_harness import Reasoner
from rosgraph_msgs.msg import Clock


class Task:
    """A goal, and all that its client hears."""

    def __init__(self, client, function, **goal):
        self.feedback = []
        nfrs = [ExpectedQA(*pair) for pair in goal.pop("nfrs", ())]
        message = ObjectiveGoal(function=function, nfrs=nfrs, **goal)
        self._handle = client.send_goal(message, feedback_cb=lambda _, feedback: self.feedback.append(feedback))

    def cancel(self):
        self._handle.cancel()

    def is_active(self):
        return self._handle.get_goal_status() == GoalStatus.ACTIVE

    def text(self):
        return self._handle.get_goal_status_text()

    def fulfilled_by(self, configuration):
        """Wait until the goal is fulfilled by a configuration."""
        wait_for(
            lambda: (
                self.feedback
                and (self.feedback[-1].fulfilled, self.feedback[-1].configuration)
                == (
                    True,
                    configuration,
                )
            ),
            lambda: f"{configuration}, after {self.feedback}",
        )

    def ended(self):
        """Wait for the end; return the state and the reason."""
        wait_for(lambda: self._handle.get_comm_state() == actionlib.CommState.DONE, lambda: f"the end of {self.text()}")
        return self._handle.get_goal_status(), self._handle.get_result().reason


class ObjectiveTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("objective_test")
        cls.diagnostics = Diagnostics()

    def system(self, namespace, **parameters):
        """Return a manipulator, and a reasoner of a model whose only objective is o_grasp."""
        return Manipulator(namespace), Reasoner(namespace, self.diagnostics, **{**SETTINGS, **parameters})

    def break_lens(self, reasoner):
        """Report that the lens fails, and wait until the reasoner knows: another topic may be faster."""
        self.diagnostics.component("lens", "FALSE")
        wait_for_equal(lambda: reasoner.service("feasible", Feasible, "f_see").functions[0].designs, [], "nothing sees")

    def client(self, namespace):
        client = actionlib.ActionClient(f"{namespace}/mros1_reasoner/objective", ObjectiveAction)
        wait_for(lambda: client.wait_for_server(rospy.Duration(0, -1)), "the action")
        return client

    def test_goals_of_two_functions_are_fulfilled_replaced_and_given_up(self):
        manipulator, reasoner = self.system("/site/hand")
        with reasoner:
            client = self.client("/site/hand")
            look = Task(client, "f_see", nfrs=[("performance", 0.1)])
            look.fulfilled_by("see_far")
            wait_for(look.is_active, "it is active")
            wait_for_equal(look.text, "objective o_see is new")
            grasp = Task(client, "f_grasp")
            grasp.fulfilled_by("grasp_firm")
            wait_for_equal(grasp.text, "objective o_grasp is there already: its limits are replaced")

            self.diagnostics.component("lens", "FALSE")
            grasp.fulfilled_by("grasp_soft")
            wait_for(lambda: not look.feedback[-1].fulfilled, "the lens fails")
            self.diagnostics.component("lens", "TRUE")
            look.fulfilled_by("see_far")

            other = Task(client, "f_see", name="o_other", nfrs=[("performance", 0.2)])
            self.assertEqual(look.ended(), (GoalStatus.PREEMPTED, "REPLACED"))
            other.fulfilled_by("see_far")
            self.assertEqual(other.feedback[-1].objective, "o_see")

            for task in (grasp, other):
                task.cancel()
                self.assertEqual(task.ended(), (GoalStatus.PREEMPTED, "CANCELLED"))
            wait_for_equal(lambda: set(manipulator.running) - {"f_see"}, {"f_grasp"}, "the model's objective stays")

    def test_bad_goals_are_rejected_in_one_line(self):
        _, reasoner = self.system("/strict")
        with reasoner:
            client = self.client("/strict")
            for words, goal in (
                ("no Function is called 'f_fly'", Task(client, "f_fly")),
                ("Unsupported QA TYPE received: taste", Task(client, "f_see", nfrs=[("taste", 1.0)])),
                ("is nan, not a finite number", Task(client, "f_see", nfrs=[("performance", float("nan"))])),
                ("give the least level first", Task(client, "f_see", nfrs=[("performance", x) for x in (0.9, 0.1)])),
                ("always_improve is 7", Task(client, "f_see", always_improve=7)),
                ("give_up_after is -1.0", Task(client, "f_see", give_up_after=-1.0)),
                ("o_grasp is one of f_grasp, not of f_see", Task(client, "f_see", name="o_grasp")),
            ):
                self.assertEqual(goal.ended(), (GoalStatus.REJECTED, "REJECTED"))
                self.assertIn(words, goal.text())
                self.assertNotIn("\n", goal.text())

    def test_unreachable_goal_waits_or_is_aborted_and_the_service_ends_one(self):
        manipulator, reasoner = self.system("/blind")
        with reasoner:
            client = self.client("/blind")
            self.break_lens(reasoner)
            wait_for_equal(lambda: manipulator.running, {"f_grasp": "grasp_soft"}, "what needs no lens runs alone")
            patient = Task(client, "f_see")
            wait_for(lambda: patient.feedback and "UNREACHABLE" in patient.feedback[-1].o_status, "it can't be reached")
            self.assertIn("UNGROUNDED", patient.feedback[-1].o_status)
            hasty = Task(client, "f_see", give_up_after=0.5)
            self.assertEqual(patient.ended(), (GoalStatus.PREEMPTED, "REPLACED"))
            self.assertEqual(hasty.ended(), (GoalStatus.ABORTED, "NOT_FULFILLED"))
            removed = Task(client, "f_see")
            wait_for(removed.is_active, "it is active")
            wait_for(lambda: reasoner.service("remove_objective", RemoveObjective, "o_see").ok, "the removal")
            self.assertEqual(removed.ended(), (GoalStatus.ABORTED, "REMOVED"))

    def test_reasoner_that_ends_says_so_and_its_successor_is_asked_again(self):
        manipulator, reasoner = self.system("/again")
        with reasoner:
            goal = Task(self.client("/again"), "f_see")
            asking = Asking(Need("f_grasp", {"performance": (0.1, 0.9)}), "/again/mros1_reasoner/objective")
            self.addCleanup(asking.end)
            asking.begin()
            goal.fulfilled_by("see_far")
            wait_for(lambda: asking.look() is Standing.FULFILLED, lambda: asking.words)
            reasoner._process.send_signal(signal.SIGTERM)
            self.assertEqual(goal.ended(), (GoalStatus.ABORTED, "ENDED"))
            wait_for(lambda: asking.look() is Standing.WAITING, lambda: asking.words)
            reasoner._process.wait()
            for _ in range(2):
                reasoner.start()
                manipulator.announce()
                wait_for(lambda: asking.look() is Standing.FULFILLED, lambda: asking.words)
                reasoner.kill()  # without a word
            self.assertEqual(manipulator.running, {"f_see": "see_far", "f_grasp": "grasp_firm"})

    def test_simulated_time_that_starts_late_is_waited_for(self):
        _, reasoner = self.system("/late", start_grace=0.0)
        rospy.set_param("/use_sim_time", True)  # heeded by the nodes that start from now on
        self.addCleanup(rospy.set_param, "/use_sim_time", False)
        with reasoner:
            client = self.client("/late")
            self.break_lens(reasoner)
            goal = Task(client, "f_see", give_up_after=30.0)
            wait_for(goal.is_active, "it is active before the clock runs")
            clock = rospy.Publisher("/clock", Clock, queue_size=10, latch=True)
            clock.publish(rospy.Time(1_700_000_000))
            wait_for(lambda: goal.feedback and "lens" in goal.feedback[-1].why, lambda: goal.feedback)
            clock.publish(rospy.Time(1_700_000_029))
            rejected = Task(client, "f_fly")  # a sign that it has gone on
            self.assertEqual(rejected.ended()[1], "REJECTED")
            self.assertTrue(goal.is_active())

            def is_over():
                clock.publish(rospy.Time(1_700_000_100))
                return not goal.is_active()

            wait_for(is_over, "it gives up")
            self.assertEqual(goal.ended(), (GoalStatus.ABORTED, "NOT_FULFILLED"))


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "objective", ObjectiveTest)
