#!/usr/bin/env python3
"""The reasoner's services, approval, dry run, explanations and journal; bad input does not stop it."""

import subprocess
import sys
import tempfile
import threading
import unittest
from functools import partial
from pathlib import Path

import rosbag
import rospy
import rostest
from helpers.robot_side import Diagnostics, Manipulator, status
from helpers.waiting import DEADLINE_S, wait_for
from metacontrol_msgs.msg import Decision, ExpectedQA, ReasonerJournal
from metacontrol_msgs.srv import (
    AddObjective,
    ApproveDecision,
    Feasible,
    RemoveObjective,
    SaveKnowledgeBase,
    SetNfr,
)
from mros1_reasoner.io.ontology_files import read_knowledge_base
from reasoner_harness import MODEL, NODE, Reasoner
from rosgraph_msgs.msg import Log
from std_srvs.srv import Trigger

PACKAGE = "metacontrol_tests"


class Recorder:
    """Writes a reasoner's decisions and journal into a bag, as `rosbag record` does, and knows what it has."""

    def __init__(self, path, namespace):
        self._bag = rosbag.Bag(str(path), "w")
        self._namespace = namespace
        self._lock = threading.Lock()
        self._decisions, self._results = set(), set()
        self._subscribers = [
            rospy.Subscriber(f"{namespace}/mros1_reasoner/{name}", kind, partial(self._take, name))
            for name, kind in (("decision", Decision), ("journal", ReasonerJournal))
        ]

    def __enter__(self):
        wait_for(lambda: all(s.get_num_connections() for s in self._subscribers), "the recorder is connected")
        return self

    def __exit__(self, *_):
        for subscriber in self._subscribers:
            subscriber.unregister()
        with self._lock:
            self._bag.close()
            self._bag = None

    def holds(self, decision_id):
        """Tell whether it has the whole of a decision."""
        return decision_id in self._decisions and decision_id in self._results

    def _take(self, name, message):
        with self._lock:
            if self._bag is None:
                return
            self._bag.write(f"{self._namespace}/mros1_reasoner/{name}", message, rospy.Time.now())
            if name == "decision" and message.state == "EXECUTED":
                self._decisions.add(message.id)
            elif name == "journal":
                self._results |= {item.values[0] for item in message.entries if item.kind == "result"}


class OperatorTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("reasoner_operator_test")
        cls.diagnostics = Diagnostics()

    def system(self, namespace, **parameters):
        """Return a manipulator in which scan_slow runs, and a reasoner that is not started yet."""
        manipulator = Manipulator(namespace)
        manipulator.announce("scan_slow")
        return manipulator, Reasoner(namespace, self.diagnostics, **parameters)

    def takes(self, reasoner, name, kind=Trigger, *arguments):
        """Call a service that must succeed; return its answer."""
        answer = reasoner.service(name, kind, *arguments)
        self.assertTrue(getattr(answer, "ok", getattr(answer, "success", None)), answer.message)
        return answer

    def refuses(self, reasoner, name, kind, *arguments):
        """Call a service that must refuse; return why."""
        answer = reasoner.service(name, kind, *arguments)
        self.assertFalse(answer.ok)
        self.assertNotIn("\n", answer.message)
        return answer.message

    def heeds_component(self, reasoner, name, value):
        """Report a component and a level after it; wait until the level is logged, so the component is known."""
        before = len(reasoner.listener.log)
        self.diagnostics.component(name, value)

        def told():
            self.diagnostics.tell(status("QA status", ("safety", "0.1")))
            return any("TYPE: safety" in line for line in reasoner.listener.log[before:])

        wait_for(told, "a level in the log")

    def test_pause_lock_and_what_they_leave(self):
        manipulator, reasoner = self.system("/operator")
        with reasoner:
            self.takes(reasoner, "pause")
            self.heeds_component(reasoner, "laser", "FALSE")
            self.assertEqual(manipulator.requests, [])
            self.takes(reasoner, "resume")
            self.assertEqual(reasoner.listener.decided("EXECUTED").to_configuration, "camera_slow")

            self.takes(reasoner, "lock")
            self.diagnostics.component("laser", "TRUE")
            self.diagnostics.component("camera", "FALSE")
            refusal = reasoner.listener.decided("FAILED")
            self.assertEqual(refusal.to_configuration, "")
            self.assertIn("locked by the operator", refusal.explanation)
            self.assertEqual(manipulator.requests, ["camera_slow"])
            self.takes(reasoner, "unlock")
            self.assertEqual(reasoner.listener.decided("EXECUTED", 2).to_configuration, "scan_slow")

    def test_decisions_wait_for_approval(self):
        manipulator, reasoner = self.system("/approval", approval=True)
        with reasoner:
            self.assertEqual(self.refuses(reasoner, "approve", ApproveDecision, ""), "no decision waits for approval")
            self.diagnostics.component("laser", "FALSE")
            proposal = reasoner.listener.decided("PROPOSED")
            reasoner.listener.logged("waits for approval")
            self.refuses(reasoner, "approve", ApproveDecision, "another")
            self.takes(reasoner, "reject", ApproveDecision, proposal.id)
            other = reasoner.listener.decided("PROPOSED", 2)
            self.assertNotEqual(other.to_configuration, proposal.to_configuration)
            self.assertEqual(manipulator.requests, [])
            self.takes(reasoner, "approve", ApproveDecision, "")
            self.assertEqual(reasoner.listener.decided("DECIDED").id, other.id)
            self.assertEqual(reasoner.listener.decided("EXECUTED").id, other.id)
            self.assertEqual(manipulator.requests, [other.to_configuration])

    def test_dry_run_decides_and_asks_nobody(self):
        manipulator, reasoner = self.system("/dry", dry_run=True)
        with reasoner:
            self.diagnostics.component("laser", "FALSE")
            advice = reasoner.listener.decided("ADVISED")
            self.assertEqual((advice.from_configuration, advice.to_configuration), ("scan_slow", "camera_slow"))
            reasoner.listener.logged("dry run, nobody is asked; o_moveA: component laser")
            self.heeds_component(reasoner, "base", "FALSE")
            self.assertEqual(reasoner.listener.decided("FAILED").to_configuration, "")
            self.assertEqual(manipulator.requests, [])

    def test_mission_logic_asks_and_changes_what_is_needed(self):
        with tempfile.TemporaryDirectory() as folder:
            _, reasoner = self.system("/mission", save_folder=folder)
            with reasoner:
                self.asks_what_is_feasible(reasoner)
                self.changes_limits_and_objectives(reasoner)
                self.saves_what_is_known(reasoner, Path(folder).resolve())

    def asks_what_is_feasible(self, reasoner):
        answer = self.takes(reasoner, "feasible", Feasible, "")
        self.assertEqual([f.function for f in answer.functions], ["f_move"])
        self.assertEqual(answer.functions[0].designs[0], "scan_fast")
        self.assertIn("no Function is called 'f_fly'", self.refuses(reasoner, "feasible", Feasible, "f_fly"))
        command = [sys.executable, str(NODE.with_name("feasible")), "--node", f"{reasoner.namespace}/reasoner"]
        text = subprocess.run([*command, "--pddl"], capture_output=True, text=True, timeout=60, check=False).stdout
        self.assertIn("(best scan_fast f_move)", text)
        told = subprocess.run([*command, "f_fly"], capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual((told.returncode, "no Function is called 'f_fly'" in told.stderr), (2, True))

    def changes_limits_and_objectives(self, reasoner):
        self.assertIn("comfort", self.refuses(reasoner, "set_nfr", SetNfr, "", "comfort", 0.5))
        self.assertIn("not a finite", self.refuses(reasoner, "set_nfr", SetNfr, "", "safety", float("nan")))
        self.refuses(reasoner, "set_nfr", SetNfr, "o_fly", "safety", 0.5)
        self.refuses(reasoner, "remove_objective", RemoveObjective, "o_fly")
        self.refuses(reasoner, "add_objective", AddObjective, "o fly*", "f_move", [])
        self.refuses(reasoner, "add_objective", AddObjective, "o_fly", "f_fly", [])
        self.takes(reasoner, "add_objective", AddObjective, "o_other", "f_move", [ExpectedQA("safety", 0.25)])
        reasoner.listener.logged("o_other needs f_move with safety 0.25")
        self.takes(reasoner, "remove_objective", RemoveObjective, "o_other")
        self.takes(reasoner, "set_nfr", SetNfr, "", "safety", 0.15)

        def asked():
            self.diagnostics.tell(status("QA status", ("safety", "0.2")))
            return [d for d in reasoner.listener.decisions if d.trigger == "qa:safety"]

        self.assertEqual(wait_for(asked, "a decision because of the new limit")[0].reasons[0].limit, 0.15)

    def saves_what_is_known(self, reasoner, folder):
        answer = self.takes(reasoner, "save_knowledge_base", SaveKnowledgeBase, "now.owl")
        self.assertEqual(answer.message, str(folder / "now.owl"))
        self.assertEqual(
            set(read_knowledge_base([folder / "now.owl"]).designs), set(read_knowledge_base([MODEL]).designs)
        )
        for path in ("../now.owl", "/etc/now.owl", "not/there/now.owl", ".", "\0"):
            self.refuses(reasoner, "save_knowledge_base", SaveKnowledgeBase, path)

    def test_published_tools_find_their_lines(self):
        _, reasoner = self.system("/published")
        with reasoner:
            for text in (
                f"Loaded ontology: {MODEL}",
                "[RosReasoner] -- Reasoner Initialization Ok",
                "Objective created and set to ungrounded",
            ):
                reasoner.printed(text)
            self.diagnostics.component("laser", "FALSE")
            reasoner.listener.decided("EXECUTED")
            self.diagnostics.tell(
                status("QA status", ("not_a_qa", "0.2"), name="fg_print"),
                status("QA status", ("energy", "0.20"), name="fg_print"),
            )
            for level, text in (
                (Log.INFO, "Exited timer_cb after successful reconfiguration"),
                (Log.INFO, "QA value received!\tTYPE: energy\tVALUE: 0.20"),
                (Log.WARN, "Unsupported QA TYPE received: not_a_qa"),
            ):
                wait_for(
                    lambda level=level, text=text: any(
                        line.level == level and line.msg == text for line in reasoner.listener.lines
                    ),
                    lambda text=text: f"{text}; logged {reasoner.listener.log}",
                )

    def test_flood_of_bad_diagnostics_leaves_few_lines_and_the_loop_going(self):
        _, reasoner = self.system("/flood")
        with reasoner:
            before = len(reasoner.listener.log)
            flood = [status("QA status", (f"quality_{i}", "0.5"), name=f"fg_{i}") for i in range(100_000)]
            flood += [status("QA status", ("safety", text)) for text in ("nan", "-inf", "1e999", "", "very", "0,5")]
            flood += [
                status("Component status", (name, "FALSE"))
                for name in ("*", "/*", "las*", "a/b", "", "\0", "x" * 10_000)
            ]
            flood += [status("QA status", ("energy", "1e300")), status("Component status", ("laser", "FALSE"))]
            self.diagnostics.tell(*flood)
            self.assertIn("camera_slow", reasoner.listener.decided("EXECUTED").to_configuration)
            self.assertLess(len(reasoner.listener.log) - before, 60)

    def test_recorded_bag_explains_and_replays_what_was_decided(self):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "run.bag"
            manipulator, reasoner = self.system("/bag")
            with reasoner:
                shown = self.command("explain", "--topic", "/bag/mros1_reasoner/decision")
                self.assertEqual(shown, "no decision yet\n")
                self.diagnostics.component("laser", "FALSE")  # before it is recorded
                reasoner.listener.decided("EXECUTED")
                with Recorder(path, "/bag") as recorder:
                    manipulator.failures = [0]
                    self.diagnostics.component("laser", "TRUE")
                    self.diagnostics.component("camera", "FALSE")
                    reasoner.listener.decided("FAILED")
                    last = reasoner.listener.decided("EXECUTED", 2)
                    wait_for(lambda: recorder.holds(last.id), "the end of the story in the bag")
                shown = self.command("explain", "--topic", "/bag/mros1_reasoner/decision", "--wait", str(DEADLINE_S))
                self.assertIn(last.id, shown)
                ids = list(dict.fromkeys(decision.id for decision in reasoner.listener.decisions))
                topic = ("--topic", "/bag/mros1_reasoner/decision")
                shown = self.command("explain", *topic, "--last", "2")
                positions = [shown.find(decision) for decision in ids[-2:]]
                self.assertEqual(positions, sorted(positions))
                self.assertGreaterEqual(positions[0], 0)
                self.assertNotIn(ids[-3], shown)
                shown = self.command("explain", *topic, "--last", "99")
                self.assertTrue(all(shown.count(decision) == 1 for decision in ids), shown)
            count = len({decision.id for decision in reasoner.listener.decisions})
            self.assertIn("requires camera, which does not work", self.command("explain", str(path)))
            output = self.command("replay", str(path))
            self.assertEqual(output.count("the same"), count - 1, output)  # the first one was before
            self.assertNotIn("differs", output)

    def command(self, name, *arguments):
        done = subprocess.run(
            [sys.executable, str(NODE.with_name(name)), *arguments],
            capture_output=True,
            text=True,
            timeout=DEADLINE_S,
            check=False,
        )
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout


if __name__ == "__main__":
    rostest.rosrun(PACKAGE, "reasoner_operator_test", OperatorTest)
