#!/usr/bin/env python3
"""The reasoner of a hand, beside a manipulator that runs several functions: restarts, releases, first failures."""

import unittest

import actionlib
import rospy
import rostest
from helpers.robot_side import Diagnostics
from helpers.waiting import wait_for
from metacontrol_msgs.msg import (
    ActiveConfiguration,
    ChangeFunctionAction,
    ChangeFunctionResult,
    FunctionGrounding,
    MvpReconfigurationAction,
    MvpReconfigurationResult,
    ReconfigurationResult,
)
from reasoner_harness import HERE, Reasoner

FUNCTION_OF = {"grasp_firm": "f_grasp", "grasp_soft": "f_grasp", "see_far": "f_see", "see_near": "f_see"}
SETTINGS = {
    "model_file": HERE / "data" / "grasp.owl",
    "components": "{finger: {node: hand/finger_driver}}",
    "restart_grace": 0.2,
    "start_grace": 0.5,
}


class Manipulator:
    """Deploys in no time, whatever is not broken, and runs several functions."""

    def __init__(self, namespace, broken=(), has_changes=True):
        self.requests, self.running, self.broken = [], {}, set(broken)
        prefix = f"{namespace}/rosgraph_manipulator"
        self._active = rospy.Publisher(f"{prefix}/active_configuration", ActiveConfiguration, queue_size=5, latch=True)
        self._servers = [self._serve(f"{prefix}_action_server", MvpReconfigurationAction, self._reconfigure)]
        if has_changes:
            self._servers.append(self._serve(f"{prefix}/change_function", ChangeFunctionAction, self._change))

    @staticmethod
    def _serve(name, kind, execute):
        server = actionlib.SimpleActionServer(name, kind, lambda goal: execute(server, goal), auto_start=False)
        server.start()
        return server

    def announce(self):
        groundings = [FunctionGrounding(function, name, "STABLE") for function, name in self.running.items()]
        self._active.publish(ActiveConfiguration(functions=groundings))

    def stop(self, function):
        """Stop a function without having been asked to."""
        del self.running[function]
        self.announce()

    def _reconfigure(self, server, goal):
        self.requests.append(goal.desired_configuration_name)
        ok = self._deploy(FUNCTION_OF[self.requests[-1]], self.requests[-1])
        code = ReconfigurationResult.OK if ok else ReconfigurationResult.GENERAL_ERROR
        (server.set_succeeded if ok else server.set_aborted)(MvpReconfigurationResult(code))

    def _change(self, server, goal):
        self.requests.append((goal.function, goal.configuration, *goal.restart))
        if goal.configuration:
            self._deploy(goal.function, goal.configuration)
        else:
            self.stop(goal.function)
        server.set_succeeded(ChangeFunctionResult(ReconfigurationResult.OK, ""))

    def _deploy(self, function, configuration):
        if configuration not in self.broken:
            self.running[function] = configuration
            self.announce()
        return configuration not in self.broken


class FunctionsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("reasoner_functions_test")
        cls.diagnostics = Diagnostics()

    def reasoner(self, namespace):
        return Reasoner(namespace, self.diagnostics, **SETTINGS)

    def test_life_of_two_functions(self):
        manipulator = Manipulator("/hand_1", broken=["see_far"])
        with self.reasoner("/hand_1") as reasoner:
            # A requirement whose first deployment fails is blamed, though nothing could be restored.
            wait_for(lambda: manipulator.running == {"f_see": "see_near", "f_grasp": "grasp_firm"}, "both functions")
            self.assertEqual(manipulator.requests, ["see_far", "see_near", "grasp_firm"])
            reasoner.listener.decided("EXECUTED", 2)

            self.diagnostics.component("finger", "FALSE")
            wait_for(lambda: len(manipulator.requests) >= 4, "the hung node is restarted")
            self.assertEqual(manipulator.requests[-1], ("f_grasp", "grasp_firm", "/hand_1/hand/finger_driver"))
            done = reasoner.listener.decided("EXECUTED", 3)
            self.assertEqual((done.from_configuration, done.to_configuration), ("grasp_firm", "grasp_firm"))
            self.diagnostics.component("finger", "RECOVERED")

            self.diagnostics.component("lens", "FALSE")
            wait_for(lambda: manipulator.running == {"f_grasp": "grasp_soft"}, "what needs no lens runs alone")
            self.assertEqual(manipulator.requests[-2:], ["grasp_soft", ("f_see", "")])
            self.assertEqual(reasoner.listener.decided("EXECUTED", 4).releases, ["o_see"])

            manipulator.stop("f_grasp")
            wait_for(lambda: manipulator.running == {"f_grasp": "grasp_soft"}, "what has vanished is deployed again")
            self.assertEqual(manipulator.requests[-1], "grasp_soft")

    def test_manipulator_with_the_published_action_alone_is_asked_for_what_it_can(self):
        manipulator = Manipulator("/hand_2", has_changes=False)
        with self.reasoner("/hand_2") as reasoner:
            wait_for(lambda: manipulator.running == {"f_see": "see_far", "f_grasp": "grasp_firm"}, "both functions")
            reasoner.listener.decided("EXECUTED", 2)
            self.diagnostics.component("finger", "FALSE")
            reasoner.listener.logged("has no action /hand_2/rosgraph_manipulator/change_function")
            reasoner.listener.decided("EXECUTED", 3)
            self.assertEqual(manipulator.requests, ["see_far", "grasp_firm", "grasp_firm"])
            self.diagnostics.component("finger", "TRUE")
            self.diagnostics.component("lens", "FALSE")
            reasoner.listener.decided("EXECUTED", 4)
            self.assertEqual(manipulator.requests[3:], ["grasp_soft"])
            lines = [line for line in reasoner.listener.log if "has no action" in line]
            self.assertEqual(len(lines), 1)


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "reasoner_functions", FunctionsTest)
