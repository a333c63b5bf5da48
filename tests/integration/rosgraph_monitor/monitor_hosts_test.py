#!/usr/bin/env python3
"""The monitor and a node on another host, whose link is cut and comes back."""

import os
import signal
import subprocess
import sys
import unittest

import psutil
import rospy
import rostest
from helpers.waiting import wait_for
from monitor_common import NODE, Diagnostics, end, start_node, value_of

HOST = os.environ["OTHER_HOST"]
INTO = ("/usr/sbin/ip", "netns", "exec", HOST)
MEMORY = 150  # MB
# The node is process 1 of its host, as one is here. A line on the standard input starts the launcher there.
FAR_HOST = """
exec 3<&0
(read -r <&3; exec rosrun rosgraph_launcher rosgraph_launcher __name:=rosgraph_launcher_arm) &
exec "$0" -c "$1" far
"""


def link(state):
    subprocess.run(["/usr/sbin/ip", "-n", HOST, "link", "set", "eth0", state], check=True)


def far_environment():
    port = os.environ["ROS_MASTER_URI"].rstrip("/").rpartition(":")[2]
    return os.environ | {
        "ROS_IP": os.environ["OTHER_ADDRESS"],
        "ROS_MASTER_URI": f"http://{os.environ['THIS_ADDRESS']}:{port}",
    }


class MonitorHostsTest(unittest.TestCase):
    def setUp(self):
        rospy.init_node("monitor_hosts_test")
        self.seen = Diagnostics()
        self.near = start_node("near")
        self.addCleanup(end, self.near)

    def wait_until_both_are_seen(self):
        self.seen.wait_status("camera", "Component status", "TRUE")
        self.seen.wait_status("laser", "Component status", "TRUE")

    def wait_for_figures(self, node, count=1):
        """Wait for figures that are told from now on; return the last one of memory."""
        self.seen.forget()
        wait_for(lambda: len(self.seen.statuses(node, "Memory Usage")) >= count, f"{count} figures of {node}")
        return float(self.seen.statuses(node, "Memory Usage")[-1].values[0].value)

    def test_lost_host_is_unreachable_and_delays_nobody_else(self):
        far = start_node("far", prefix=INTO, env=far_environment())
        self.addCleanup(end, far)
        self.wait_until_both_are_seen()
        link("down")
        self.addCleanup(link, "up")
        self.seen.wait_status("camera", "Component status", "FALSE")
        _, status = self.seen.wait_status("far", "Missing node")
        self.assertEqual(value_of(status, "actual"), "unreachable")
        self.seen.forget()
        self.near.kill()
        self.seen.wait_status("laser", "Component status", "FALSE")
        self.seen.forget()
        link("up")
        self.seen.wait_status("camera", "Component status", "RECOVERED")

    def test_usage_of_a_node_is_told_by_the_launcher_of_its_host(self):
        node = f"block = b'x' * ({MEMORY} << 20); {NODE}"
        alone = ("unshare", "--pid", "--fork", "--mount-proc", "--kill-child")
        far = subprocess.Popen(
            [*INTO, *alone, "bash", "-c", FAR_HOST, sys.executable, node], env=far_environment(), stdin=subprocess.PIPE
        )
        self.addCleanup(end, far)
        self.wait_until_both_are_seen()
        self.wait_for_figures("near", 3)
        self.assertEqual(self.seen.statuses("far", "Memory Usage"), [])  # and not those of process 1 here
        far.stdin.write(b"\n")
        far.stdin.flush()
        self.assertGreater(self.wait_for_figures("far"), MEMORY)
        self.seen.wait_status("far", "CPU Usage")
        (launcher,) = (
            process
            for process in psutil.Process(far.pid).children(recursive=True)
            if "__name:=rosgraph_launcher_arm" in process.cmdline()
        )
        launcher.send_signal(signal.SIGSTOP)
        self.wait_for_figures("near", 5)
        self.wait_for_figures("near", 2)
        self.assertEqual(self.seen.statuses("far", "Memory Usage"), [])
        launcher.send_signal(signal.SIGCONT)
        self.assertGreater(self.wait_for_figures("far"), MEMORY)


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "monitor_hosts", MonitorHostsTest)
