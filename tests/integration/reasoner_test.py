#!/usr/bin/env python3
"""The node reasoner on a master: facts as diagnostics in, requests and Decisions out."""

import os
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import actionlib
import psutil
import rosgraph
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from metacontrol_msgs.msg import (
    ActiveConfiguration,
    Decision,
    FunctionGrounding,
    MvpReconfigurationAction,
    MvpReconfigurationResult,
)
from rosgraph_msgs.msg import Log

PACKAGE = "metacontrol_tests"
DEADLINE_S = 15.0
HERE = Path(__file__).resolve().parent
MODEL = HERE / "reasoner" / "application.owl"
NODE = HERE.parents[1] / "catkin_ws" / "src" / "mros1_reasoner" / "nodes" / "reasoner"


def wait_for(condition, what, deadline=DEADLINE_S):
    """Wait, at most until the deadline, until the condition holds; return what it gave."""
    until = time.monotonic() + deadline
    while not (found := condition()):
        if time.monotonic() > until:
            raise AssertionError(f"not within {deadline:g} s: {what}")
        time.sleep(0.02)
    return found


class Manipulator:
    """Deploys in no time: announces, answers with the result that the test has set, None: not at all."""

    def __init__(self):
        self.result = 1
        self.requests = []
        self.running = ""
        self._active = rospy.Publisher(
            "rosgraph_manipulator/active_configuration", ActiveConfiguration, queue_size=5, latch=True
        )
        self._server = actionlib.SimpleActionServer(
            "rosgraph_manipulator_action_server", MvpReconfigurationAction, self._execute, auto_start=False
        )
        self._server.start()

    def announce(self, configuration, state="STABLE"):
        """Say what runs."""
        self.running = configuration
        grounding = FunctionGrounding("f_move", configuration, state)
        self._active.publish(ActiveConfiguration(functions=[grounding]))

    def _execute(self, goal):
        name = goal.desired_configuration_name
        self.requests.append(name)
        if self.result is None:
            wait_for(self._server.is_preempt_requested, "a request to give up")
            self._server.set_preempted()
        elif self.result == 1:
            self.announce(name, "RECONFIGURING")
            self.announce(name)
            self._server.set_succeeded(MvpReconfigurationResult(1))
        else:
            self._server.set_aborted(MvpReconfigurationResult(self.result), "it did not come up")


class ReasonerTest(unittest.TestCase):
    """One story: what happens first is needed for what comes later, so the steps are in one test."""

    @classmethod
    def setUpClass(cls):
        rospy.init_node("reasoner_test")
        cls.decisions, cls.log = [], []
        rospy.Subscriber("/mros1_reasoner/decision", Decision, cls.decisions.append, queue_size=50)
        rospy.Subscriber("/rosout", Log, cls._on_log, queue_size=500)
        cls.diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=50)
        cls.manipulator = Manipulator()
        cls.manipulator.announce("scan_slow")
        wait_for(cls.is_ready, "the reasoner is ready")

    @classmethod
    def _on_log(cls, message):
        if message.name.startswith("/reasoner"):
            cls.log.append(message.msg)

    @classmethod
    def is_ready(cls):
        """Tell whether the reasoner listens, and is heard."""
        state = rosgraph.Master("/reasoner_test").getSystemState()
        listens = any(topic == "/diagnostics" and "/reasoner" in nodes for topic, nodes in state[1])
        return listens and cls.diagnostics.get_num_connections() >= 1

    def tell(self, message, *values, level=0, name="", stamp=None):
        """Publish one status, and return its stamp."""
        status = DiagnosticStatus(level=level, name=name, message=message, values=[KeyValue(*pair) for pair in values])
        array = DiagnosticArray(status=[status])
        array.header.stamp = stamp or rospy.Time.now()
        self.diagnostics.publish(array)
        return array.header.stamp

    def component(self, name, status):
        """Publish the status of a component."""
        return self.tell("Component status", (name, status), name=name, level=2 if status == "FALSE" else 0)

    def decided(self, state, count):
        """Wait until so many decisions of a state were heard; return the last."""
        found = wait_for(
            lambda: [d for d in self.decisions if d.state == state][count - 1 :], f"decision {count} of state {state}"
        )
        return found[0]

    def quality(self, name, level):
        """Publish levels until the next request; return how long that took, s."""
        began, before = time.monotonic(), len(self.manipulator.requests)

        def asked():
            self.tell("QA status", (name, str(level)))
            time.sleep(0.1)  # the observer's period
            return len(self.manipulator.requests) > before

        wait_for(asked, f"a request because of {name}")
        return time.monotonic() - began

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
            self.tell(message, *values)
        wait_for(lambda: any("Unsupported QA TYPE received: comfort" in line for line in self.log), "the warning")
        wait_for(lambda: any("sonar is not in the model" in line for line in self.log), "the warning of the component")
        self.assertEqual(self.manipulator.requests, [])
        self.assertEqual(self.decisions, [])

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

        for status in ("FALSE", "RECOVERED", "TRUE"):  # repeated failure, return: nothing to do
            self.component("laser", status)

    def heeds_a_quality_after_window_and_cool_down_and_tries_another_design_after_a_failure(self):
        manipulator = self.manipulator
        manipulator.result = 0
        took = self.quality("energy", 0.9)
        self.assertGreater(took, 0.9)
        failed = self.decided("FAILED", 1)
        self.assertEqual(failed.trigger, "qa:energy")
        self.assertIn("it did not come up", failed.explanation)
        self.assertEqual(failed.to_configuration, "scan_slow")
        manipulator.result = 1
        self.quality("energy", 0.9)
        self.assertEqual(self.decided("EXECUTED", 2).to_configuration, "scan_slower")

    def gives_up_a_manipulator_that_hangs(self):
        manipulator = self.manipulator
        manipulator.result = None
        count = len(manipulator.requests)
        self.tell("Missing node", level=2, name="front_laser")
        hung = self.decided("FAILED", 2)
        self.assertEqual(hung.trigger, "component:laser")
        self.assertIn("no result within 3 s", hung.explanation)
        manipulator.result = 1
        wait_for(lambda: len(manipulator.requests) > count + 1, "another request")
        self.assertEqual(self.decided("EXECUTED", 3).to_configuration, manipulator.requests[-1])
        self.assertTrue(manipulator.requests[-1].startswith("camera"))

    def logs_what_published_tools_wait_for(self):
        for text in (
            "Exited timer_cb after successful reconfiguration",
            "QA value received!\tTYPE: energy\tVALUE: 0.9",
        ):
            wait_for(lambda text=text: any(text in line for line in self.log), text)

    def survives_the_death_of_pellets_process(self):
        pid = rosgraph_pid("/reasoner")
        (child,) = psutil.Process(pid).children()
        child.kill()
        before = len(self.decisions)
        self.component("base", "FALSE")
        refusal = wait_for(lambda: self.decisions[before:], "a refusal")[0]
        self.assertEqual((refusal.state, refusal.to_configuration), ("FAILED", ""))

    def test_without_a_manipulator_it_grounds_what_it_decides(self):
        arguments = ["__name:=reasoner_second", "rosgraph_manipulator/active_configuration:=second/active"]
        arguments += [f"_model_file:={MODEL}", "_use_reconfigure_srv:=false", "_nfr_safety:=0.25"]
        before = len(self.log)
        process = subprocess.Popen([sys.executable, str(NODE), *arguments], stdout=subprocess.DEVNULL)
        try:
            for text in (
                "Objective created and set to ungrounded: o_moveA",
                "[RosReasoner] -- Reasoner Initialization Ok",
                "o_moveA: no configuration runs: nothing -> scan_slower",
                "Exited timer_cb after successful reconfiguration",
            ):
                wait_for(lambda text=text: any(text in line for line in self.log[before:]), text)
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
                lines = [line for line in error.splitlines() if line.startswith("reasoner: ")]
                self.assertEqual(process.returncode, 2, f"{name}: {error}")
                self.assertEqual(len(lines), 1, f"{name}: {error}")
                self.assertIn(cases[name][2], lines[0])
                self.assertNotIn("Traceback", error, name)


def rosgraph_pid(node):
    """Return the process id of a node."""
    import xmlrpc.client

    uri = rosgraph.Master("/reasoner_test").lookupNode(node)
    return xmlrpc.client.ServerProxy(uri).getPid("/reasoner_test")[2]


if __name__ == "__main__":
    rostest.rosrun(PACKAGE, "reasoner_test", ReasonerTest)
