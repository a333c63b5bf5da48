#!/usr/bin/env python3
"""The monitor when its master ends, or is not there, or its parameters make no sense. Uses a master of its own."""

import os
import signal
import socket
import subprocess
import time
import unittest
import xmlrpc.client

import rostest


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def wait_for(condition, timeout):
    end = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(f"condition not met within {timeout} s")
        time.sleep(0.02)


class MonitorMasterTest(unittest.TestCase):
    def setUp(self):
        port = free_port()
        self.uri = f"http://localhost:{port}"
        self.environment = {**os.environ, "ROS_MASTER_URI": self.uri}
        self.environment.pop("ROS_NAMESPACE", None)
        self.master_port = port
        self.processes = []

    def tearDown(self):
        for process in self.processes:
            if process.poll() is None:
                process.kill()
                process.wait()

    def start(self, *command):
        process = subprocess.Popen(command, env=self.environment, stderr=subprocess.PIPE, text=True)
        self.processes.append(process)
        return process

    def start_master(self):
        master = self.start("rosmaster", "--core", "-p", str(self.master_port))
        self.proxy = xmlrpc.client.ServerProxy(self.uri)
        wait_for(self.master_answers, 10.0)
        return master

    def master_answers(self):
        try:
            return self.proxy.getPid("/test")[0] == 1
        except OSError:
            return False

    def start_monitor(self):
        monitor = self.start("rosrun", "rosgraph_monitor", "monitor")
        wait_for(lambda: any("/load_observer" in entry for entry in self.proxy.getSystemState("/test")[2][2]), 10.0)
        return monitor

    def test_lost_master_is_said_in_one_line_and_ends_the_monitor(self):
        master = self.start_master()
        monitor = self.start_monitor()
        master.send_signal(signal.SIGKILL)
        _, stderr = monitor.communicate(timeout=20.0)
        self.assertEqual(monitor.returncode, 0)
        lines = stderr.strip().splitlines()
        self.assertEqual(len(lines), 1, stderr)
        self.assertIn(self.uri, lines[0])

    def test_no_master_is_said_in_one_line(self):
        monitor = self.start("rosrun", "rosgraph_monitor", "monitor")
        _, stderr = monitor.communicate(timeout=10.0)
        self.assertEqual(monitor.returncode, 2)
        self.assertEqual(len(stderr.strip().splitlines()), 1, stderr)

    def test_bad_parameters_are_said_in_one_line(self):
        self.start_master()
        bad = {
            "rate": -1.0,
            "components": ["front_laser"],
            "desired_rossystem": "/nowhere/base.rossystem",
            "observers": "SafetyQualityObserver",
        }
        for name, value in bad.items():
            self.proxy.setParam("/test", f"/rosgraph_monitor/{name}", value)
            monitor = self.start("rosrun", "rosgraph_monitor", "monitor")
            _, stderr = monitor.communicate(timeout=10.0)
            self.assertEqual(monitor.returncode, 2, name)
            self.assertEqual(len(stderr.strip().splitlines()), 1, stderr)
            self.proxy.deleteParam("/test", f"/rosgraph_monitor/{name}")


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "monitor_master", MonitorMasterTest)
