#!/usr/bin/env python3
"""The node reasoner on a master: facts as diagnostics in, requests and Decisions out."""

import os
import subprocess
import sys
import tempfile
import time
import unittest

import psutil
import rospy
import rostest
from helpers.robot_side import Diagnostics, Manipulator, status
from helpers.waiting import DEADLINE_S, wait_for
from reasoner_harness import MODEL, NODE, Listener, node_pid, start_node, wait_until_printed

PACKAGE = "metacontrol_tests"


class ReasonerTest(unittest.TestCase):
    """One story: what happens first is needed for what comes later, so the steps are in one test."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("reasoner_test")
        cls.listener = Listener()
        cls.diagnostics = Diagnostics()
        cls.manipulator = Manipulator()
        cls.manipulator.announce("scan_slow")
        wait_for(lambda: cls.diagnostics.reaches("/reasoner"), "the reasoner is ready")
        wait_for(lambda: cls.listener.is_connected, "the reasoner is heard")
        wait_for(lambda: cls.manipulator.is_known, "the reasoner has found the manipulator")

    def component(self, name, value):
        return self.diagnostics.component(name, value)

    def decided(self, state, count):
        return self.listener.decided(state, count)

    def quality(self, name, level, count):
        """Publish levels until there are so many requests."""

        def asked():
            self.diagnostics.tell(status("QA status", (name, str(level))))
            time.sleep(0.1)  # the observer's period
            return len(self.manipulator.requests) >= count

        wait_for(asked, lambda: f"{count} requests because of {name}, not {self.manipulator.requests}")

    def test_story(self):
        """Each part starts from what the one before has left."""
        self.takes_over_what_runs_and_leaves_bad_diagnostics_out()
        self.takes_the_best_camera_design_when_the_laser_fails()
        self.heeds_a_quality_after_window_and_cool_down_and_tries_another_design_after_a_failure()
        self.gives_up_a_manipulator_that_hangs()
        self.logs_what_published_tools_wait_for()
        self.survives_the_death_of_pellets_process()

    def takes_over_what_runs_and_leaves_bad_diagnostics_out(self):
        for message, values in (
            ("QA status", [("safety", "nan")]),
            ("QA status", [("safety", "inf")]),
            ("QA status", []),
            ("QA status", [("comfort", "0.9")]),
            ("QA status", [("safety", "very")]),
            ("Component status", [("sonar", "FALSE")]),
            ("Component status", [("laser", "")]),
            ("QA stale", [("safety", "no scan")]),
        ):
            self.diagnostics.tell(status(message, *values))
        for text in (
            "Unsupported QA TYPE received: comfort",
            "sonar is not in the model",
            "QA safety can't be observed: no scan",  # what was told last
        ):
            self.listener.logged(text)
        self.assertEqual(self.manipulator.requests, [])
        self.assertEqual(self.listener.decisions, [])

    def takes_the_best_camera_design_when_the_laser_fails(self):
        stamp = self.component("laser", "FALSE")
        first = self.decided("DECIDED", 1)
        done = self.decided("EXECUTED", 1)
        self.assertEqual(self.manipulator.requests, ["camera_slow"])
        self.assertEqual((first.trigger, first.objective), ("component:laser", "o_moveA"))
        self.assertEqual((first.from_configuration, first.to_configuration), ("scan_slow", "camera_slow"))
        self.assertEqual(first.stamp_monitored, stamp)
        self.assertEqual(first.stamp_executed, rospy.Time())
        self.assertEqual(first.id, done.id)
        self.assertFalse(first.degraded)
        self.assertEqual(len(first.candidates), 6)
        self.assertTrue(first.candidates[0].chosen)
        times = [done.stamp_monitored, done.stamp_analysed, done.stamp_planned, done.stamp_executed]
        self.assertEqual(times, sorted(times))
        self.assertGreaterEqual(done.stamp_analysed, stamp)
        self.assertGreater(done.analyse_wall_s, 0.0)
        self.assertGreater(done.execute_wall_s, 0.0)

        for value in ("FALSE", "RECOVERED", "TRUE"):  # repeated failure, return: nothing to do
            self.component("laser", value)

    def heeds_a_quality_after_window_and_cool_down_and_tries_another_design_after_a_failure(self):
        self.manipulator.failures = [0]
        self.quality("energy", 0.9, count=2)
        done, failed = self.decided("EXECUTED", 1), self.decided("FAILED", 1)
        self.assertGreater(failed.stamp_planned - done.stamp_executed, rospy.Duration(0.99))  # of 1 s, rounded
        self.assertEqual(failed.trigger, "qa:energy")
        self.assertIn("it did not come up", failed.explanation)
        self.assertEqual(failed.to_configuration, "scan_slow")
        self.quality("energy", 0.9, count=3)
        self.assertEqual(self.decided("EXECUTED", 2).to_configuration, "scan_slower")

    def gives_up_a_manipulator_that_hangs(self):
        manipulator = self.manipulator
        manipulator.failures = [None]
        count = len(manipulator.requests)
        self.diagnostics.tell(status("Missing node", level=2, name="front_laser"))
        hung = self.decided("FAILED", 2)
        self.assertEqual(hung.trigger, "component:laser")
        self.assertIn("no result within 10 s", hung.explanation)
        wait_for(lambda: len(manipulator.requests) > count + 1, "another request")
        self.assertEqual(self.decided("EXECUTED", 3).to_configuration, manipulator.requests[-1])
        self.assertTrue(manipulator.requests[-1].startswith("camera"))

    def logs_what_published_tools_wait_for(self):
        for text in (
            "Exited timer_cb after successful reconfiguration",
            "QA value received!\tTYPE: energy\tVALUE: 0.9",
        ):
            self.listener.logged(text)

    def survives_the_death_of_pellets_process(self):
        pid = node_pid("/reasoner")
        (child,) = psutil.Process(pid).children()
        child.kill()
        before = len(self.listener.decisions)
        self.component("base", "FALSE")
        refusal = wait_for(lambda: self.listener.decisions[before:], "a refusal")[0]
        self.assertEqual((refusal.state, refusal.to_configuration), ("FAILED", ""))

    def test_without_a_manipulator_it_grounds_what_it_decides(self):
        arguments = ["__name:=reasoner_second", "rosgraph_manipulator/active_configuration:=second/active"]
        arguments += [f"_model_file:={MODEL}", "_use_reconfigure_srv:=false", "_nfr_safety:=0.25"]
        output = self.enterContext(tempfile.NamedTemporaryFile("w"))
        process = start_node(output, *arguments)
        try:
            for text in (
                "o_moveA needs f_move with safety 0.25",
                "[RosReasoner] -- Reasoner Initialization Ok",
                "o_moveA: no configuration runs: nothing -> scan_slower",
                "Exited timer_cb after successful reconfiguration",
            ):
                wait_until_printed(output, text)
        finally:
            process.terminate()
            process.wait(DEADLINE_S)

    def test_what_can_not_start_says_so_in_one_line_and_ends_with_2(self):
        with tempfile.NamedTemporaryFile("w", suffix=".owl") as broken:
            broken.write("this is not OWL")
            broken.flush()
            cases = {
                "broken": ([f"_model_file:={broken.name}"], {}, "is not an OWL file"),
                "missing": (["_model_file:=/nowhere/x.owl"], {}, "/nowhere/x.owl: No such file"),
                "unset": ([], {}, "~model_file is not set"),
                "bad": ([f"_model_file:={MODEL}", "_violation_window:=-1"], {}, "~violation_window is -1"),
                "javaless": (
                    [f"_model_file:={MODEL}"],
                    {"PATH": "/nowhere", "JAVA_HOME": ""},
                    "openjdk-17-jre-headless",
                ),
            }
            processes = {
                name: subprocess.Popen(
                    [sys.executable, str(NODE), f"__name:=reasoner_{name}", *arguments],
                    env={**os.environ, **environment},
                    stderr=subprocess.PIPE,
                    stdout=subprocess.DEVNULL,
                    text=True,
                )
                for name, (arguments, environment, _) in cases.items()
            }
            for name, process in processes.items():
                _, error = process.communicate(timeout=DEADLINE_S)
                lines = [line for line in error.splitlines() if line.lstrip("/").startswith("reasoner")]
                self.assertEqual(process.returncode, 2, f"{name}: {error}")
                self.assertEqual(len(lines), 1, f"{name}: {error}")
                self.assertIn(cases[name][2], lines[0])
                self.assertNotIn("Traceback", error, name)


if __name__ == "__main__":
    rostest.rosrun(PACKAGE, "reasoner_test", ReasonerTest)
