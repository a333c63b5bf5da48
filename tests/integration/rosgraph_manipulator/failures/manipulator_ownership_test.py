#!/usr/bin/env python3
"""A node that somebody else's launch file starts, too, under the same name: it is told, and never called stable."""

import os
import signal
import subprocess
from pathlib import Path

import rostest
from helpers.waiting import DEADLINE_S, wait_for
from integration.rosgraph_manipulator.manipulator_harness import HERE, Node, PairTest, pid_of
from rosgraph_launcher.io.ownership import launcher_mark, look_up
from rosgraph_launcher.launching.ownership import Owner


class OwnershipTest(PairTest):
    manipulator_parameters = {"ready_timeout": 30.0, "probation": 0.0}

    def setUp(self):
        self.mark = launcher_mark("/rosgraph_launcher")
        wait_for(lambda: self.is_in("slow", "STABLE") or self.request("slow") == 1, "slow runs")

    def owner(self):
        return look_up("/wait_server").owner(self.mark)

    def start_foreign(self):
        """Start a user's roslaunch, which starts its node whenever that ends."""
        process = subprocess.Popen(
            ["/usr/bin/roslaunch", str(HERE / "respawned.launch")], stdout=subprocess.DEVNULL, start_new_session=True
        )

        def end():
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
                process.wait(DEADLINE_S)

        self.addCleanup(end)
        return end

    def test_node_that_another_launch_file_respawns_fails_with_the_remedy(self):
        self.assertIs(self.owner(), Owner.LAUNCHER)
        ours, before = pid_of("/wait_server"), len(self.states)
        end_foreign = self.start_foreign()
        wait_for(lambda: self.launcher_state.state == "FAILED", lambda: f"FAILED, not {self.launcher_state}")
        failed = self.launcher_state.message
        self.assertIn("its name is taken by process", failed)
        self.assertIn("respawned.launch", failed)
        self.assertIn('remove the node from that launch file, or its respawn="true"', failed)
        self.assertNotEqual(pid_of("/wait_server"), ours)

        wait_for(lambda: self.state.state == "FAILED", "the configuration has failed")
        self.assertEqual(self.stable_since(before), [], "never stable while the other one takes the name")
        wait_for(lambda: self.owner() is Owner.FOREIGN, "the other node runs alone")
        before = len(self.states)
        self.assertEqual(self.request("fast"), -2, "the name is free only while the other node is replaced")
        self.assertIn("its name is taken by process", self.text)
        self.assertEqual((self.state.state, self.stable_since(before)), ("FAILED", []))
        wait_for(lambda: self.owner() is Owner.FOREIGN, "the other node runs alone again")

        end_foreign()
        self.assertEqual(self.request("fast"), 1, self.text)
        self.assertIs(self.owner(), Owner.LAUNCHER)

    def test_node_that_somebody_starts_once_under_the_name_is_replaced(self):
        before = len(self.states)
        foreign = Node("metacontrol_tests", "tunable.py", "__name:=wait_server")
        self.addCleanup(foreign.end, signal.SIGKILL)
        wait_for(lambda: [s for s in self.states[before:] if s.functions[0].state == "RECOVERING"], "it is noticed")
        (line,) = {s.message for s in self.states[before:] if s.functions[0].state == "RECOVERING"}
        self.assertIn("its name is taken by process", line)
        wait_for(lambda: self.stable_since(before), "it recovers")
        self.assertIs(self.owner(), Owner.LAUNCHER)

    def stable_since(self, number):
        """What was told of a stable configuration since there were so many messages."""
        return [message for message in self.states[number:] if message.functions[0].state == "STABLE"]


if __name__ == "__main__":
    os.chdir(Path(__file__).parent)
    rostest.rosrun("metacontrol_tests", "manipulator_ownership", OwnershipTest)
