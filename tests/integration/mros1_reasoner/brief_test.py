#!/usr/bin/env python3
"""A part of a station always dies soon after it is deployed: its designs are tried with waits, until one lasts."""

import contextlib
import os
import signal
import threading
import xmlrpc.client

import rosgraph
import rostest
from helpers.waiting import wait_for
from reasoner_harness import node_pid
from station_harness import StationTest

ALIVE = 0.7  # s, longer than the manipulator's `settle_time`, so that each deployment succeeds


class BriefTest(StationTest):
    namespace = "/plant"

    def test_designs_that_never_last_are_tried_with_waits_and_the_other_functions_go_on(self):
        self.wait_for_configurations()
        before = self.pids("f_grasp")
        ended = threading.Event()
        self.addCleanup(ended.set)
        killer = threading.Thread(target=self.kill_again_and_again, args=(ended,), daemon=True)
        killer.start()
        wait_for(lambda: self.waits() and self.retries(), lambda: f"waits and retries are told: {self.texts()}")
        ending = r"deployments? did not last \((ended|was taken back) [0-9.]+ s after it was deployed\)"
        for text in self.waits():
            self.assertRegex(text, ending)
        self.assertEqual(self.pids("f_grasp"), before, "what has nothing to do with it runs on")
        ended.set()
        killer.join()
        wait_for(lambda: self.active.get("f_look", ("", ""))[1] == "STABLE", lambda: f"it runs again: {self.active}")

    def waits(self):
        return [text for text in self.texts() if "is tried again in" in text]

    def retries(self):
        return [d.explanation for d in self.decisions if d.state == "DECIDED" and "did not last" in d.explanation]

    def texts(self):
        return [decision.explanation for decision in self.decisions]

    def kill_again_and_again(self, ended):
        """Kill each process of the looker a while after it has begun to answer, once it counts as deployed."""
        while not ended.wait(0.02):
            with contextlib.suppress(rosgraph.MasterException, OSError, xmlrpc.client.Error):  # it is not there
                pid = node_pid(self.name("looker"))
                if not ended.wait(ALIVE) and self.active.get("f_look", ("", ""))[1] == "STABLE":
                    os.kill(pid, signal.SIGKILL)


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "brief", BriefTest)
