#!/usr/bin/env python3
"""A function over two hosts: its nodes, its launchers and the link between the hosts fail and come back."""

import os
import re
import signal
import tempfile
from contextlib import suppress
from pathlib import Path

import psutil
import rospy
import rostest
from helpers.waiting import DEADLINE_S, wait_for
from integration.rosgraph_manipulator.manipulator_harness import PairTest, is_alive, pid_of
from manipulator_hosts_harness import ADDRESS, FAR_LAUNCHER, Respawned, link

DATA = Path(__file__).resolve().parent / "data"
NEAR, FAR = "/near_node", "/far_node"
LIFE = Path(tempfile.mkdtemp()) / "life"
HOLD = Path(f"{LIFE}.hold")


def configuration(name, *args):
    return {"function": "f_wait", "launch": str(DATA / f"{name}.launch"), "args": list(args)}


class HostsTest(PairTest):
    configurations = {
        "both": configuration("hosts", f"address:={ADDRESS}"),
        "missing": configuration("hosts", f"address:={ADDRESS}", "far:=no_such_node.py"),
        "dies": configuration("hosts", f"address:={ADDRESS}", "far:=wait_server.py", "far_args:=--die-after 0"),
        "nowhere": configuration("hosts", "address:=192.0.2.1"),
        "near": configuration("near"),
        "held": configuration("hosts", f"address:={ADDRESS}", "far:=lived.py", f"far_args:={LIFE} 0"),
    }
    manipulator_parameters = {
        "save_action": "",
        "goal_msg_type": "",
        "initial_configuration": "near",
        "host_timeout": 8.0,
        "launcher_timeout": 20.0,
        "probation": 0.0,
    }

    @classmethod
    def setUpClass(cls):
        # A node stays dead long enough for the manipulator to see it.
        rospy.set_param(FAR_LAUNCHER, {"restart_delay": 3.0, "restart_period": 200.0})
        super().setUpClass()
        cls.far = Respawned()
        cls.addClassCleanup(cls.far.end)

    def setUp(self):
        link("up")
        wait_for(self.has_both, lambda: f"the other host is there: {self.text}")
        self.wait_for_state("both")
        self.near_pid, self.far_pid = pid_of(NEAR), pid_of(FAR)
        self.said_before = len(self.manipulator.said())

    def has_both(self):
        """Ask for both nodes; only the loss of the other host may refuse that.

        A launcher whose link was down for long has lost the master, and still answers while it ends.
        """
        succeeds = self.request("both") == 1
        self.assertTrue(succeeds or f"host {ADDRESS} is lost" in self.text, self.text)
        return succeeds

    def said(self):
        return self.manipulator.said()[self.said_before :]

    def test_nodes_run_on_their_hosts(self):
        namespaces = {os.readlink(f"/proc/{pid}/ns/net") for pid in (self.near_pid, os.getpid())}
        self.assertEqual(len(namespaces), 1)
        self.assertNotIn(os.readlink(f"/proc/{self.far_pid}/ns/net"), namespaces)

    def test_request_that_keeps_the_nodes_keeps_those_of_all_hosts(self):
        self.assertEqual(self.request("both"), 1, self.text)
        self.assertEqual((pid_of(NEAR), pid_of(FAR)), (self.near_pid, self.far_pid))

    def test_node_that_dies_there_is_started_again_there(self):
        os.kill(self.far_pid, signal.SIGKILL)
        self.wait_for_state("both", "RECOVERING")
        self.wait_for_state("both")
        self.assertNotIn(pid_of(FAR), (None, self.far_pid))
        self.assertEqual(pid_of(NEAR), self.near_pid)

    def test_death_of_the_launcher_there_ends_its_nodes_and_they_are_deployed_again(self):
        os.kill(pid_of(f"/{FAR_LAUNCHER}"), signal.SIGKILL)
        wait_for(lambda: not is_alive(self.far_pid), "its node ends with it")
        wait_for(lambda: pid_of(FAR), "the node is started again")
        self.wait_for_state("both")

    def test_death_of_the_manipulator_leaves_all_nodes(self):
        self.manipulator.end(signal.SIGKILL)
        self.states.clear()
        type(self).start_manipulator()
        self.wait_for_state("both")
        self.wait_until_it_serves()
        self.assertEqual(self.request("both"), 1, self.text)
        self.assertEqual((pid_of(NEAR), pid_of(FAR)), (self.near_pid, self.far_pid))

    def test_failure_there_ends_the_nodes_here(self):
        while not self.is_in("both", "FAILED"):
            pid = wait_for(
                lambda: self.is_in("both", "FAILED") or pid_of(FAR), "the node is started again, or given up"
            )
            if not self.is_in("both", "FAILED"):
                with suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
                wait_for(lambda: not is_alive(pid), "the node has ended")  # noqa: B023
        wait_for(lambda: not is_alive(self.near_pid), "what is left of the function ends")

    def test_what_succeeded_here_is_taken_back_when_it_fails_there(self):
        self.assertEqual(self.request("near"), 1, self.text)
        self.assertIsNone(pid_of(FAR))
        for name, words in (("missing", "no_such_node.py"), ("dies", FAR)):
            self.assertEqual(self.request(name), 0, self.text)
            self.assertIn(words, self.text)
            self.assertIn("near was restored", self.text)
            wait_for(lambda: pid_of(NEAR) and not pid_of(FAR), "what ran before runs")

    def test_host_without_launcher_is_named_with_node_and_remedy(self):
        self.assertEqual(self.request("nowhere"), 0)
        self.assertIn(f"node {FAR} is for host 192.0.2.1, where no rosgraph_launcher runs", self.text)
        self.assertIn("roslaunch rosgraph_launcher launcher.launch", self.text)
        self.assertIn("both", self.text)

    def test_lost_host_is_named_once_and_its_nodes_are_deployed_again_when_it_is_back(self):
        link("down")
        self.wait_for_state("both", "FAILED")
        wait_for(lambda: not is_alive(self.near_pid), "what is left of the function ends")
        line = f"host {ADDRESS} is lost"
        self.assertIn(line, self.states[-1].message)
        self.assertEqual(self.said().count(line), 1, self.said())
        link("up")
        self.wait_for_state("both")
        self.assertTrue(pid_of(NEAR) and pid_of(FAR))

    def lose_host_while_it_deploys_again(self, begin):
        """Have the configuration deployed again by what `begin` does, lose the host during that, and end the loss."""
        self.addCleanup(HOLD.unlink, missing_ok=True)
        self.assertEqual(self.request("held"), 1, self.text)
        while not self.is_held_after(begin):
            pass
        link("down")
        self.wait_for_state("held", "FAILED")
        self.assertIn(f"host {ADDRESS} is lost", self.states[-1].message)
        HOLD.unlink()
        link("up")
        self.wait_for_state("held")
        self.assertTrue(pid_of(NEAR) and pid_of(FAR))

    def is_held_after(self, begin):
        """Have the configuration deployed again, so that its far node waits before it is one.

        False where that failed for a busy master that did not answer in time: nothing is tried again then.
        """
        HOLD.unlink(missing_ok=True)
        wait_for(lambda: self.request("held") == 1, lambda: f"it runs: {self.text}")
        HOLD.touch()
        lives, said = LIFE.read_text().count("begins"), len(self.manipulator.said())
        begin()

        def gave_up():
            return re.search("held: .*ROS master .* does not answer", self.manipulator.said()[said:])

        wait_for(lambda: LIFE.read_text().count("begins") > lives or gave_up(), "its node has begun, and is held")
        return not gave_up()

    def test_host_that_is_lost_again_during_the_deployment_after_its_return_is_waited_for_once_more(self):
        def begin():
            link("down")
            self.wait_for_state("held", "FAILED")
            link("up")

        self.lose_host_while_it_deploys_again(begin)

    def test_host_that_is_lost_during_the_deployment_after_the_death_of_its_launcher_is_waited_for(self):
        self.lose_host_while_it_deploys_again(lambda: os.kill(pid_of(f"/{FAR_LAUNCHER}"), signal.SIGKILL))

    def test_lost_host_does_not_delay_the_start_of_the_manipulator(self):
        self.assertEqual(self.request("near"), 1, self.text)
        self.manipulator.end()
        link("down")
        longer = 10 * DEADLINE_S  # than this test waits
        rospy.set_param("rosgraph_manipulator/host_timeout", longer)
        rospy.set_param("rosgraph_manipulator/launcher_timeout", longer)
        self.states.clear()
        try:
            type(self).start_manipulator()
            self.wait_for_state("near")
        finally:
            self.manipulator.end()
            link("up")
            for name in ("host_timeout", "launcher_timeout"):
                rospy.set_param(f"rosgraph_manipulator/{name}", self.manipulator_parameters[name])
            type(self).start_manipulator()
            self.wait_until_it_serves()

    def test_other_configuration_works_without_the_lost_host(self):
        link("down")
        self.wait_for_state("both", "FAILED")
        self.assertEqual(self.request("near"), 1, self.text)
        self.wait_for_state("near")
        link("up")
        wait_for(lambda: not psutil.pid_exists(self.far_pid) or not is_alive(self.far_pid), "what is left there ends")
        wait_for(lambda: pid_of(f"/{FAR_LAUNCHER}"), "the launcher of the other host is there")
        self.assertTrue(self.is_in("near", "STABLE"))


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "manipulator_hosts", HostsTest)
