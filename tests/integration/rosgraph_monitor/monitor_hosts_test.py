#!/usr/bin/env python3
"""The monitor and a node on another host, whose link is cut and comes back."""

import os
import subprocess
import unittest

import rospy
import rostest
from monitor_common import Diagnostics, end, start_node, value_of

HOST = os.environ["OTHER_HOST"]


def link(state):
    subprocess.run(["/usr/sbin/ip", "-n", HOST, "link", "set", "eth0", state], check=True)


class MonitorHostsTest(unittest.TestCase):
    def test_lost_host_is_unreachable_and_delays_nobody_else(self):
        rospy.init_node("monitor_hosts_test")
        seen = Diagnostics()
        port = os.environ["ROS_MASTER_URI"].rstrip("/").rpartition(":")[2]
        far = start_node(
            "far",
            prefix=("/usr/sbin/ip", "netns", "exec", HOST),
            env=os.environ
            | {
                "ROS_IP": os.environ["OTHER_ADDRESS"],
                "ROS_MASTER_URI": f"http://{os.environ['THIS_ADDRESS']}:{port}",
            },
        )
        self.addCleanup(end, far)
        near = start_node("near")
        self.addCleanup(end, near)
        seen.wait_status("camera", "Component status", "TRUE")
        seen.wait_status("laser", "Component status", "TRUE")
        link("down")
        seen.wait_status("camera", "Component status", "FALSE")
        _, status = seen.wait_status("far", "Missing node")
        self.assertEqual(value_of(status, "actual"), "unreachable")
        seen.forget()
        near.kill()
        seen.wait_status("laser", "Component status", "FALSE")
        seen.forget()
        link("up")
        seen.wait_status("camera", "Component status", "RECOVERED")


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "monitor_hosts", MonitorHostsTest)
