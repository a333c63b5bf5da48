#!/usr/bin/env python3
"""What follows when a node ends: by roslaunch, and by the launcher."""

import contextlib
import os
import signal
import subprocess
import tempfile
from pathlib import Path

import rosgraph
import rostest
from helpers.cases import case
from helpers.waiting import DEADLINE_S, wait_for, wait_for_equal
from integration.rosgraph_manipulator.manipulator_harness import PairTest, pid_of

DATA = Path(__file__).resolve().parent / "data"
LAUNCH = str(DATA / "ends.launch")
KINDS = {
    "respawned": ["respawn:=true"],
    "required": ["required:=true"],
    "required_failing": ["required:=true", "status:=3"],
    "failing": ["status:=3"],
    "finishing": [],
    "idle": ["idle:=true"],
}
MORE_THAN_INTENSITY = 6


def starts():
    with contextlib.suppress(rosgraph.MasterError):
        return rosgraph.Master("/test").getParam("/launched_starts")
    return 0


def let_end():
    """Let the node end, as often as it has begun; it counts its starts after it is up."""
    rosgraph.Master("/test").setParam("/launched_go", wait_for(starts, "the node has begun"))


class LaunchedEndsTest(PairTest):
    configurations = {name: {"function": "f", "launch": LAUNCH, "args": args} for name, args in KINDS.items()}
    manipulator_parameters = {"save_action": "", "initial_configuration": "", "probation": 0.0}

    def setUp(self):
        self.launch("idle")
        self.forget()

    def forget(self):
        for name in ("/launched_starts", "/launched_go"):
            with contextlib.suppress(rosgraph.MasterError):
                rosgraph.Master("/test").deleteParam(name)

    @contextlib.contextmanager
    def roslaunch(self, name):
        with tempfile.TemporaryFile("w+") as output:
            process = subprocess.Popen(
                ["/usr/bin/roslaunch", LAUNCH, *KINDS[name]],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                env={**os.environ, "PYTHONUNBUFFERED": "1"},
            )
            self.read = lambda: (output.seek(0), output.read())[1]
            wait_for(lambda: starts() and pid_of("/long"), "roslaunch has started the nodes")
            try:
                yield process
            finally:
                process.send_signal(signal.SIGINT)
                process.wait(DEADLINE_S)
            wait_for(lambda: not pid_of("/long"), "the nodes have ended")
        self.forget()

    def launch(self, name):
        self.assertEqual(self.request(name), 1, self.text)

    def let_end_often(self):
        for number in range(1, MORE_THAN_INTENSITY + 1):
            wait_for(lambda: starts() == number and pid_of("/short"), f"start {number}")  # noqa: B023
            let_end()
        wait_for_equal(starts, MORE_THAN_INTENSITY + 1, "it has begun once more")

    def test_respawned_node_may_end_with_status_0_again_and_again(self):
        with self.roslaunch("respawned"):
            self.let_end_often()
        self.launch("respawned")
        self.let_end_often()
        self.assertTrue(self.is_in("respawned", "STABLE"))

    def test_end_of_a_required_node_ends_all_nodes(self):
        for name, status in (("required", 0), ("required_failing", 3)):
            with case(name):
                with self.roslaunch(name) as process:
                    let_end()
                    process.wait(DEADLINE_S)
                self.launch(name)
                let_end()
                self.wait_for_state(name, "FAILED")
                wait_for(lambda: not pid_of("/long"), "the other node has ended")
                wait_for(lambda: self.launcher_state.state == "FAILED", lambda: f"FAILED: {self.launcher_state}")
                self.assertIn(f"node /short ended with status {status}", self.launcher_state.message)
                self.assertIn(f"it is required: {name} is stopped", self.launcher_state.message)
                self.setUp()

    def test_node_that_fails_is_told_with_its_status(self):
        with self.roslaunch("failing"):
            let_end()
            wait_for(lambda: "exit code 3" in self.read(), "roslaunch tells it")
            self.assertTrue(pid_of("/long"))
        self.launch("failing")
        let_end()
        wait_for_equal(starts, 2, "the launcher has started it again, which roslaunch does not")
        self.assertIn("node /short ended with status 3", self.launcher.said())
        self.assertTrue(pid_of("/long"))

    def test_node_that_has_finished_is_not_started_again(self):
        with self.roslaunch("finishing"):
            let_end()
            wait_for(lambda: "finished cleanly" in self.read(), "roslaunch tells it")
        self.launch("finishing")
        let_end()
        wait_for_equal(lambda: self.launcher_state.nodes, ["/long"], "the launcher tells it")
        self.assertTrue(self.is_in("finishing", "STABLE"))
        self.assertEqual(starts(), 1)


if __name__ == "__main__":
    os.chdir(Path(__file__).parent)
    rostest.rosrun("metacontrol_tests", "launched_ends", LaunchedEndsTest)
