#!/usr/bin/env python3
"""What stands around the monitor: the aggregator's groups, the live table, the snapshot on the command line."""

import json
import signal
import subprocess
import threading
import unittest

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticStatus
from helpers.waiting import DEADLINE_S
from monitor_common import Diagnostics, end, run, start_node


class MonitorToolsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node("monitor_tools_test")
        cls.near = start_node("near")

    @classmethod
    def tearDownClass(cls):
        end(cls.near)

    def test_aggregator_groups_what_the_monitor_says(self):
        groups = Diagnostics("/diagnostics_agg")
        for name in (
            *("/MROS/Components/laser", "/MROS/Qualities/cpu_load", "/MROS/Graph/far: Missing node"),
            *("/MROS/Usage/rosgraph_monitor: Memory Usage", "/Other/rosgraph_monitor: look at the graph"),
        ):
            groups.wait(name, lambda status, name=name: status.name == name)
        self.assertEqual(
            {status.level for status in groups.statuses("/MROS/Graph/far: Missing node", "Missing node")},
            {DiagnosticStatus.ERROR},
        )

    def test_live_table_has_nodes_qualities_and_thresholds(self):
        Diagnostics().wait_status("far", "Missing node")
        done = run("watch", "--once", "6", environment={"COLUMNS": "160"})
        self.assertEqual(done.returncode, 0, done.stderr)
        for expected in ("near", "Missing node", "cpu_load", "0.9", "rosgraph_monitor"):
            self.assertIn(expected, done.stdout)

    def test_live_table_goes_through_a_pipe_too(self):
        Diagnostics().wait_status("far", "Missing node")
        words = ["/usr/bin/rosrun", "rosgraph_monitor", "watch"]
        watch = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, bufsize=1)
        self.addCleanup(watch.communicate)
        self.addCleanup(watch.kill)
        timer = threading.Timer(DEADLINE_S, watch.kill)
        timer.start()
        self.addCleanup(timer.cancel)
        self.assertTrue(any("Missing node" in line for line in watch.stdout), "it says what is wrong while it runs")
        watch.stdout.close()  # as `| head` does
        watch.stdout = None
        Diagnostics().wait_status("far", "Missing node")
        watch.send_signal(signal.SIGINT)
        self.assertEqual(watch.communicate(timeout=DEADLINE_S)[1], "")
        self.assertEqual(watch.returncode, 0)

    def test_snapshot_as_json_and_as_text(self):
        Diagnostics().wait_status("laser", "Component status", "TRUE")
        done = run("snapshot", "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        graph = json.loads(done.stdout)
        self.assertIn("/near", graph["nodes"])
        self.assertEqual(graph["topics"]["/diagnostics"]["type"], "diagnostic_msgs/DiagnosticArray")
        self.assertIn("/near ", run("snapshot").stdout)

    def test_commands_without_a_master_say_so_in_one_line(self):
        for command in (("snapshot",), ("watch", "--once", "1")):
            done = run(*command, environment={"ROS_MASTER_URI": "http://localhost:1"})
            self.assertEqual((done.returncode, len(done.stderr.strip().splitlines())), (2, 1), done.stderr)


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "monitor_tools", MonitorToolsTest)
