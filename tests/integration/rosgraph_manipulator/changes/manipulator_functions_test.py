#!/usr/bin/env python3
"""Several functions at once: a picking cell whose functions share a camera."""

import os
import signal

import actionlib
import dynamic_reconfigure.client
import rospy
import rostest
from actionlib.msg import TestAction
from actionlib_msgs.msg import GoalStatus, GoalStatusArray
from helpers.waiting import DEADLINE_S, wait_for, wait_for_equal
from integration.action_clients import SureActionClient
from integration.rosgraph_manipulator.manipulator_harness import HERE, PairTest, pid_of
from metacontrol_msgs.msg import ChangeFunctionAction, ChangeFunctionGoal

CAMERA, VIEWER, GRIPPER, SORTER = "/cell/camera", "/cell/viewer", "/cell/arm/gripper", "/sorter"
ACTION = "/cell/arm/wait"


def configuration(function, name, *args):
    return {"function": function, "launch": str(HERE / f"cell_{name}.launch"), "args": list(args)}


class FunctionsTest(PairTest):
    configurations = {
        "look_slowly": configuration("f_look", "look", "rate:=1.0"),
        "look_fast": configuration("f_look", "look", "rate:=4.0"),
        "pick_softly": configuration("f_pick", "pick", "force:=1"),
        "pick_hard": configuration("f_pick", "pick", "force:=9"),
        "pick_dying": configuration("f_pick", "pick", "force:=1", "args:=--die-after 0"),
        "pick_otherwise": configuration("f_pick", "pick", "force:=1", "raw:=other"),
        "sort_slowly": configuration("f_sort", "sort", "rate:=1.0"),
        "sort_fast": configuration("f_sort", "sort", "rate:=5.0"),
    }
    manipulator_parameters = {
        "save_action": "",
        "goal_msg_type": "",
        "functions": {"f_pick": {"save_action": ACTION, "goal_msg_type": "actionlib/TestAction"}},
        "initial_configuration": ["look_slowly", "sort_slowly"],
        "settle_time": 0.5,
        "probation": 0.0,
    }
    # Nodes stay dead long enough for the manipulator to see it, and no death is forgotten.
    launcher_parameters = {"restart_intensity": 2, "restart_delay": 1.0, "restart_period": 100.0}

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.changes = SureActionClient("rosgraph_manipulator/change_function", ChangeFunctionAction)
        assert cls.changes.wait_for_server(rospy.Duration(DEADLINE_S))
        cls.waiting = actionlib.ActionClient(ACTION, TestAction)
        cls.subscribers.append(rospy.Subscriber(f"{ACTION}/status", GoalStatusArray, cls.on_status))

    def setUp(self):
        for name in ("look_slowly", "pick_softly", "sort_slowly"):
            self.assertEqual(self.request(name), 1, self.text)
        self.forget_goals()
        self.wait_for_functions(f_look="look_slowly", f_pick="pick_softly", f_sort="sort_slowly")
        self.pids = self.running()

    def running(self):
        return {node: wait_for(lambda: pid_of(node), f"{node} answers") for node in (CAMERA, VIEWER, GRIPPER, SORTER)}  # noqa: B023

    def deployed(self):
        return {f.function: (f.configuration, f.state) for f in self.states[-1].functions} if self.states else {}

    def wait_for_functions(self, **configurations):
        expected = {function: (name, "STABLE") for function, name in configurations.items()}
        wait_for_equal(self.deployed, expected, "what runs")

    def change(self, function, name="", restart=()):
        self.changes.send_goal(ChangeFunctionGoal(function, name, list(restart)))
        self.assertTrue(self.changes.wait_for_result(rospy.Duration(DEADLINE_S)), f"no result for {function}")
        return self.changes.get_result()

    def assert_same(self, *nodes):
        self.assertEqual({node: pid_of(node) for node in nodes}, {node: self.pids[node] for node in nodes})

    def test_change_of_one_function_leaves_the_others_alone(self):
        goal_id, _ = self.send_goal()
        self.assertEqual(self.request("sort_fast"), 1, self.text)
        self.assertEqual(self.request("look_fast"), 1, self.text)
        self.wait_for_functions(f_look="look_fast", f_pick="pick_softly", f_sort="sort_fast")
        self.assert_same(CAMERA, GRIPPER)
        self.assertNotEqual(pid_of(SORTER), self.pids[SORTER])
        self.assertEqual(self.server_goals.get(goal_id), GoalStatus.ACTIVE)
        self.assertEqual(rospy.get_param(f"{GRIPPER}/force"), 1)

    def test_goal_of_a_function_is_kept_over_its_change(self):
        goal_id, _ = self.send_goal()
        old = self.server
        self.assertEqual(self.request("pick_hard"), 1, self.text)
        self.wait_for_goal(goal_id, old)
        self.assert_same(CAMERA, VIEWER, SORTER)

    def test_change_that_fails_restores_its_own_function_only(self):
        self.assertEqual(self.request("pick_dying"), 0)
        self.wait_for_functions(f_look="look_slowly", f_pick="pick_softly", f_sort="sort_slowly")
        self.assert_same(CAMERA, VIEWER, SORTER)

    def test_configuration_that_disagrees_on_a_shared_node_is_refused(self):
        self.assertEqual(self.request("pick_otherwise"), 0)
        self.assertIn("node /cell/camera belongs to f_pick and f_look, which runs, and differs in args", self.text)
        self.assert_same(CAMERA, VIEWER, GRIPPER, SORTER)

    def test_death_of_a_shared_node_concerns_the_functions_that_share_it(self):
        seen = len(self.states)

        def told():
            return {f.function for message in self.states[seen:] for f in message.functions if f.state == "RECOVERING"}

        os.kill(self.pids[CAMERA], signal.SIGKILL)
        wait_for_equal(told, {"f_look", "f_pick"}, "who recovers")
        self.wait_for_functions(f_look="look_slowly", f_pick="pick_softly", f_sort="sort_slowly")
        self.assertNotIn(pid_of(CAMERA), (None, self.pids[CAMERA]))
        self.assertEqual(told(), {"f_look", "f_pick"})
        self.assert_same(VIEWER, GRIPPER, SORTER)

    def test_function_whose_node_dies_too_often_fails_alone(self):
        for _ in range(3):
            pid = wait_for(lambda: pid_of(SORTER), "the sorter answers")
            os.kill(pid, signal.SIGKILL)
            wait_for(lambda: pid_of(SORTER) != pid, "it is gone")  # noqa: B023
        wait_for(lambda: self.deployed()["f_sort"][1] == "FAILED", "sorting has failed")
        self.assertEqual(self.deployed()["f_pick"], ("pick_softly", "STABLE"))
        self.assert_same(CAMERA, VIEWER, GRIPPER)
        self.assertEqual(self.request("sort_fast"), 1, self.text)

    def test_release_stops_what_only_the_function_needed(self):
        self.assertEqual(self.change("f_look").result, 1)
        self.wait_for_functions(f_pick="pick_softly", f_sort="sort_slowly")
        self.assertIsNone(pid_of(VIEWER))
        self.assertIn(f"run on: {CAMERA}", self.states[-1].message)
        self.assertFalse(rospy.has_param(f"{VIEWER}/controller_frequency"))
        self.assert_same(CAMERA, GRIPPER, SORTER)
        self.send_goal()
        wait_for(lambda: rospy.has_param(f"{ACTION}/resume_goal"), "the goal is kept")
        self.assertEqual(self.change("f_pick").result, 1)
        self.wait_for_functions(f_sort="sort_slowly")
        self.assertEqual((pid_of(CAMERA), pid_of(GRIPPER)), (None, None))
        self.assertFalse(rospy.has_param(f"{ACTION}/resume_goal"))
        self.assertEqual(self.change("f_pick").result, 1)  # nothing runs for it

    def test_requests_that_cannot_be_meant_are_refused(self):
        self.assertEqual(self.change("f_pik").result, -1)
        self.assertEqual(self.change("f_pick", "pick").result, -1)
        answer = self.change("f_pick", "sort_fast")
        self.assertEqual(answer.result, -1)
        self.assertEqual(answer.message, "configuration sort_fast is of function f_sort, not f_pick")

    def test_node_that_hangs_is_replaced_when_its_configuration_is_requested_again(self):
        goal_id, _ = self.send_goal()
        old = self.server
        os.kill(self.pids[GRIPPER], signal.SIGSTOP)
        self.assertEqual(self.request("pick_softly"), 1, self.text)
        self.wait_for_goal(goal_id, old)
        self.assert_same(CAMERA, VIEWER, SORTER)

    def test_node_that_is_to_be_restarted_is_restarted(self):
        answer = self.change("f_look", "look_slowly", [VIEWER])
        self.assertEqual(answer.result, 1, answer.message)
        self.assertNotEqual(pid_of(VIEWER), self.pids[VIEWER])
        self.assert_same(CAMERA, GRIPPER, SORTER)

    def test_parameter_that_drifted_is_set_back_without_a_restart(self):
        client = dynamic_reconfigure.client.Client(VIEWER, timeout=DEADLINE_S)
        client.update_configuration({"controller_frequency": 7.5})
        wait_for(lambda: rospy.get_param(f"{VIEWER}/controller_frequency") == 7.5, "it has drifted")
        self.assertEqual(self.request("look_slowly"), 1, self.text)
        wait_for_equal(lambda: client.get_configuration(timeout=DEADLINE_S)["controller_frequency"], 1.0, "the rate")
        self.assertEqual(rospy.get_param(f"{VIEWER}/controller_frequency"), 1.0)
        self.assert_same(VIEWER)

    def test_parameters_that_no_node_takes_while_it_runs_are_put_back_by_a_request_that_says_so(self):
        rospy.set_param(f"{GRIPPER}/force", 5)
        rospy.delete_param("/cell/site")
        self.assertEqual(self.request("pick_softly"), 1, self.text)
        self.assertEqual((rospy.get_param(f"{GRIPPER}/force"), rospy.get_param("/cell/site")), (1, "hall"))
        self.assertEqual(self.states[-1].tactic, "parameters")
        words = f"put back: /cell/site (not set, not hall), {GRIPPER}/force (5, not 1)"
        self.assertEqual(self.text, f"pick_softly is deployed by parameters; {words}")
        self.assert_same(CAMERA, VIEWER, GRIPPER, SORTER)
        self.assertEqual(self.request("pick_softly"), 1, self.text)
        self.assertEqual(self.text, "pick_softly is deployed by nothing")

    def test_node_that_dies_starts_again_with_the_parameters_of_its_configuration(self):
        rospy.set_param(f"{VIEWER}/controller_frequency", 9.0)
        os.kill(self.pids[VIEWER], signal.SIGKILL)
        wait_for(lambda: pid_of(VIEWER) not in (None, self.pids[VIEWER]), "the viewer is back")
        client = dynamic_reconfigure.client.Client(VIEWER, timeout=DEADLINE_S)
        self.assertEqual(client.get_configuration(timeout=DEADLINE_S)["controller_frequency"], 1.0)
        self.assertEqual(rospy.get_param(f"{VIEWER}/controller_frequency"), 1.0)
        self.assert_same(CAMERA, GRIPPER, SORTER)

    def test_all_functions_survive_a_killed_manipulator(self):
        self.manipulator.end(signal.SIGKILL)
        self.states.clear()
        self.start_manipulator()
        self.wait_for_functions(f_look="look_slowly", f_pick="pick_softly", f_sort="sort_slowly")
        self.assert_same(CAMERA, VIEWER, GRIPPER, SORTER)
        self.wait_until_it_serves()

        def is_released():
            self.changes.send_goal(ChangeFunctionGoal("f_look", "", []))
            return self.changes.wait_for_result(rospy.Duration(3)) and self.changes.get_result().result == 1

        wait_for(is_released, "the new manipulator takes requests")
        wait_for(lambda: not rospy.has_param(f"{VIEWER}/controller_frequency"), "its parameters are gone")

    def test_all_functions_survive_a_killed_launcher(self):
        goal_id, _ = self.send_goal()
        old = self.server
        self.launcher.end(signal.SIGKILL)
        self.start_launcher()
        self.wait_for_goal(goal_id, old)
        wait_for(lambda: None not in map(pid_of, self.pids), "all nodes are back")
        self.wait_for_functions(f_look="look_slowly", f_pick="pick_softly", f_sort="sort_slowly")


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "manipulator_functions", FunctionsTest)
