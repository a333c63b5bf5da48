#!/usr/bin/env python3
"""The node reasoner when parts are absent, come late, or die: each test has a reasoner of its own."""

import unittest

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticStatus
from helpers.robot_side import Diagnostics, Manipulator, status
from helpers.waiting import DEADLINE_S, wait_for
from integration.action_clients import SureActionClient
from metacontrol_msgs.msg import MvpReconfigurationAction, MvpReconfigurationGoal
from metacontrol_msgs.srv import Feasible
from reasoner_harness import NOTHING_RUNS, Reasoner
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Bool

PACKAGE = "metacontrol_tests"


class LifecycleTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("reasoner_lifecycle_test")
        cls.diagnostics = Diagnostics()

    def reasoner(self, namespace, **parameters):
        return Reasoner(namespace, self.diagnostics, **parameters)

    def test_first_configuration_is_asked_for_where_none_runs(self):
        manipulator = Manipulator("/first")
        with self.reasoner("/first", **NOTHING_RUNS) as reasoner:
            done = reasoner.listener.decided("EXECUTED")
            self.assertEqual(
                (done.trigger, done.from_configuration, done.to_configuration), ("initial", "", "scan_slow")
            )
            self.assertEqual(manipulator.requests, ["scan_slow"])

    def test_desired_configuration_is_the_first_one(self):
        manipulator = Manipulator("/desired")
        with self.reasoner("/desired", desired_configuration="camera_slower", **NOTHING_RUNS) as reasoner:
            reasoner.listener.decided("EXECUTED")
            self.assertEqual(manipulator.requests, ["camera_slower"])

    def test_absent_manipulator_is_asked_again_and_again_and_reported(self):
        manipulator = Manipulator("/absent", serves=False)
        manipulator.announce("scan_slow")
        with self.reasoner("/absent") as reasoner:
            reasoner.listener.logged("f_move runs scan_slow")
            self.diagnostics.component("laser", "FALSE")
            failed = reasoner.listener.decided("FAILED", 3)
            self.assertIn("is not there", failed.explanation)
            self.assertEqual(failed.to_configuration, "camera_slow")  # its absence is not the configuration's fault
            trouble = wait_for(lambda: reasoner.listener.troubles, "a diagnostic")[-1]
            self.assertEqual(trouble.level, DiagnosticStatus.ERROR)
            self.assertIn("is not there", trouble.message)
            self.assertTrue(reasoner.service("feasible", Feasible, "f_move").functions[0].feasible)  # it is not blocked

            manipulator.serve()
            self.assertEqual(reasoner.listener.decided("EXECUTED").to_configuration, "camera_slow")
            ok = [DiagnosticStatus.OK]
            wait_for(lambda: [s.level for s in reasoner.listener.troubles][-1:] == ok, "the end of the trouble")

    def test_late_manipulator_keeps_what_it_runs(self):
        with self.reasoner("/late", **NOTHING_RUNS) as reasoner:
            self.assertEqual(reasoner.listener.decided("FAILED").trigger, "initial")
            reasoner.listener.decided("DECIDED", 2)  # the manipulator is looked for again
            manipulator = Manipulator("/late", serves=False)
            manipulator.announce("scan_slow")
            reasoner.listener.logged("f_move runs scan_slow")
            manipulator.serve()
            self.diagnostics.component("laser", "FALSE")
            reasoner.listener.decided("EXECUTED")
            self.assertEqual(manipulator.requests, ["camera_slow"])

    def test_simulated_time_that_does_not_run_yet_is_waited_for(self):
        manipulator = Manipulator("/clock")
        manipulator.announce("scan_slow")
        rospy.set_param("/use_sim_time", True)  # heeded by the nodes that start from now on
        self.addCleanup(rospy.set_param, "/use_sim_time", False)
        with self.reasoner("/clock") as reasoner:
            reasoner.listener.logged("f_move runs scan_slow")
            self.diagnostics.component("laser", "FALSE")
            self.assertEqual(reasoner.listener.decided("FAILED").to_configuration, "camera_slow")
            self.assertEqual(manipulator.requests, [])
            rospy.Publisher("/clock", Clock, queue_size=1, latch=True).publish(rospy.Time(10))
            self.assertEqual(reasoner.listener.decided("EXECUTED").to_configuration, "camera_slow")

    def test_restarted_reasoner_takes_over_what_runs(self):
        manipulator = Manipulator("/again")
        manipulator.announce("scan_slow")
        with self.reasoner("/again") as reasoner:
            reasoner.listener.logged("f_move runs scan_slow")
            self.diagnostics.component("laser", "FALSE")
            reasoner.listener.decided("EXECUTED")
            reasoner.kill()
            manipulator.announce("camera_slow", "RECONFIGURING")  # it dies while the manipulator is at work
            before = len(reasoner.listener.log)
            reasoner.start()
            reasoner.listener.logged("f_move runs camera_slow (RECONFIGURING)", before)
            self.diagnostics.component("laser", "FALSE")  # as the monitor goes on to report
            manipulator.announce("camera_slow")
            for _ in range(20):
                self.diagnostics.tell(status("QA status", ("energy", "0.3")))
            reasoner.listener.logged("TYPE: energy\tVALUE: 0.3", before)
            self.assertEqual(manipulator.requests, ["camera_slow"])
            self.diagnostics.component("laser", "TRUE")
            self.diagnostics.component("camera", "FALSE")
            reasoner.listener.decided("EXECUTED", 2)
            self.assertEqual(manipulator.requests, ["camera_slow", "scan_slow"])

    def test_statuses_of_other_robots_are_not_heeded(self):
        manipulator = Manipulator("/hall_1")
        manipulator.announce("scan_slow")
        with self.reasoner("/hall_1") as reasoner:
            reasoner.listener.logged("f_move runs scan_slow")
            for owner in ("robot:/hall_2", "robot:/", "/hall_2/laser", "/dev/ttyUSB0", "none"):
                failed = status("Component status", ("laser", "FALSE"), name="laser")
                failed.hardware_id = owner
                self.diagnostics.tell(failed)
            # What is its own comes through the same connection, after those.
            failed = status("Component status", ("camera", "FALSE"), name="camera")
            failed.hardware_id = "hall_1/camera"
            self.diagnostics.tell(failed, status("QA status", ("energy", "0.3")))
            reasoner.listener.logged("TYPE: energy\tVALUE: 0.3")
            designs = reasoner.service("feasible", Feasible, "f_move").functions[0].designs
            self.assertTrue(designs)
            self.assertEqual({name.split("_")[0] for name in designs}, {"scan"})

    def test_all_on_a_topic_that_takes_the_place_of_diagnostics_is_the_robots_own(self):
        manipulator = Manipulator("/yard")
        manipulator.announce("scan_slow")
        own = Diagnostics("/yard/diagnostics")
        with Reasoner("/yard", own, "/diagnostics:=/yard/diagnostics") as reasoner:
            reasoner.listener.logged("f_move runs scan_slow")
            own.robot = ""
            own.component("laser", "FALSE")
            self.assertEqual(reasoner.listener.decided("EXECUTED").to_configuration, "camera_slow")

    def test_failed_task_violates_its_objective(self):
        manipulator = Manipulator("/task")
        manipulator.announce("scan_slow")
        errors = rospy.Publisher("/task/obj_error", Bool, queue_size=1)
        with self.reasoner("/task") as reasoner:
            reasoner.listener.logged("f_move runs scan_slow")
            self.diagnostics.tell(status("QA status", ("objetive_error", "True"), name="/obj_error"))
            first = reasoner.listener.decided("EXECUTED")
            self.assertEqual(first.trigger, "task:o_moveA")
            wait_for(lambda: errors.get_num_connections() > 0, "the reasoner listens to obj_error")
            errors.publish(True)
            second = reasoner.listener.decided("EXECUTED", 2)
            self.assertEqual((second.trigger, second.from_configuration), ("task:o_moveA", first.to_configuration))

    def test_aborted_goal_of_its_action_violates_an_objective(self):
        manipulator = Manipulator("/aborted")
        manipulator.announce("scan_slow")
        drive = Manipulator("/aborted/drive")  # serves an action; which one, does not matter
        drive.failures = [0]
        action = "drive/rosgraph_manipulator_action_server"
        with self.reasoner("/aborted", task_actions=f"{{o_moveA: {action}}}") as reasoner:
            reasoner.listener.logged("f_move runs scan_slow")
            client = SureActionClient(f"/aborted/{action}", MvpReconfigurationAction)
            self.assertTrue(client.wait_for_server(rospy.Duration(DEADLINE_S)))
            client.send_goal(MvpReconfigurationGoal("somewhere"))
            done = reasoner.listener.decided("EXECUTED")
            self.assertEqual((done.trigger, done.from_configuration), ("task:o_moveA", "scan_slow"))
            self.assertIn(f"a goal of {action} was aborted", done.explanation)


if __name__ == "__main__":
    rostest.rosrun(PACKAGE, "reasoner_lifecycle_test", LifecycleTest)
