#!/usr/bin/env python3
"""The monitor when its master ends, or is not there, or its parameters make no sense. Uses a master of its own."""

import contextlib
import os
import queue
import signal
import socket
import subprocess
import threading
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


class Proxy:
    """Stands between a node and its master, and delays, spoils or swallows the master's answers."""

    def __init__(self, master_port):
        self.mode = "pass"
        self._master_port = master_port
        self._server = socket.create_server(("127.0.0.1", 0))
        self.uri = f"http://127.0.0.1:{self._server.getsockname()[1]}"
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self):
        with contextlib.suppress(OSError):
            while True:
                client, _ = self._server.accept()
                master = socket.create_connection(("127.0.0.1", self._master_port))
                threading.Thread(target=self._pump, args=(client, master), daemon=True).start()
                threading.Thread(target=self._pump, args=(master, client, True), daemon=True).start()

    def _pump(self, source, target, to_client=False):
        with source, target, contextlib.suppress(OSError):
            while data := source.recv(65536):
                if to_client and self.mode == "slow":
                    time.sleep(0.2)
                if to_client and self.mode == "garbage":
                    data = b"HTTP/1.1 200 OK\r\nContent-Length: 7\r\n\r\ngarbage"
                if not (to_client and self.mode == "silent"):
                    target.sendall(data)

    def close(self):
        self._server.close()


READY = (1, "/rosgraph_manipulator/active_configuration")
"""What the monitor registers last."""


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
        wait_for(self.master_answers, 30.0)
        return master

    def master_answers(self):
        try:
            return self.proxy.getPid("/test")[0] == 1
        except OSError:
            return False

    def start_monitor(self, until):
        """Start it, and wait until it has registered a service (2), or a subscription (1)."""
        part, name = until
        monitor = self.start("rosrun", "rosgraph_monitor", "monitor")
        wait_for(lambda: any(name == entry[0] for entry in self.proxy.getSystemState("/test")[2][part]), 30.0)
        return monitor

    def test_lost_master_is_said_in_one_line_and_ends_the_monitor(self):
        master = self.start_master()
        monitor = self.start_monitor(READY)
        master.send_signal(signal.SIGKILL)
        _, stderr = monitor.communicate(timeout=20.0)
        self.assertEqual(monitor.returncode, 0)
        lines = stderr.strip().splitlines()
        self.assertEqual(len(lines), 1, stderr)
        self.assertIn(self.uri, lines[0])

    def test_master_lost_during_the_start_ends_the_monitor_as_well(self):
        master = self.start_master()
        monitor = self.start_monitor(until=(2, "/load_observer"))
        master.send_signal(signal.SIGKILL)
        _, stderr = monitor.communicate(timeout=40.0)
        self.assertEqual(monitor.returncode, 0)
        self.assertIn(f"{self.uri} is gone", stderr)

    def test_stopped_master_is_said_in_one_line_and_ends_the_monitor(self):
        master = self.start_master()
        monitor = self.start_monitor(READY)
        master.send_signal(signal.SIGSTOP)
        self.addCleanup(master.send_signal, signal.SIGCONT)
        _, stderr = monitor.communicate(timeout=40.0)
        self.assertEqual(monitor.returncode, 0)
        lines = stderr.strip().splitlines()
        self.assertEqual(len(lines), 1, stderr)
        self.assertIn("does not answer", lines[0])

    def test_slow_master_is_no_problem_and_one_that_answers_garbage_is_told_and_forgiven(self):
        self.start_master()
        proxy = Proxy(self.master_port)
        self.addCleanup(proxy.close)
        self.environment["ROS_MASTER_URI"] = proxy.uri
        proxy.mode = "slow"
        monitor = self.start_monitor(READY)
        lines = queue.Queue()
        reader = threading.Thread(target=lambda: [lines.put(line) for line in monitor.stderr], daemon=True)
        reader.start()
        proxy.mode = "garbage"
        while "garbage" not in lines.get(timeout=40.0):
            pass
        proxy.mode = "pass"
        node = self.start("rosrun", "rosgraph_monitor", "monitor", "__name:=second")  # the first one goes on
        wait_for(lambda: any("/second" in entry[1] for entry in self.proxy.getSystemState("/test")[2][2]), 40.0)
        self.assertIsNone(monitor.poll())
        node.terminate()
        monitor.terminate()
        self.assertEqual(monitor.wait(timeout=40.0), 0)
        reader.join(timeout=40.0)
        self.assertNotIn("Traceback", "".join(lines.queue))

    def test_no_master_is_said_in_one_line(self):
        monitor = self.start("rosrun", "rosgraph_monitor", "monitor")
        _, stderr = monitor.communicate(timeout=40.0)
        self.assertEqual(monitor.returncode, 2)
        self.assertEqual(len(stderr.strip().splitlines()), 1, stderr)

    def test_bad_parameters_are_said_in_one_line(self):
        self.start_master()
        bad = {
            "rate": -1.0,
            "components": ["front_laser"],
            "desired_rossystem": "/nowhere/base.rossystem",
            "observers": "SafetyQualityObserver",
            "topics": {"front/scan": {"min_rate": "fast"}},
            "ros_models": ["/nowhere/laser.ros"],
        }
        for name, value in bad.items():
            self.proxy.setParam("/test", f"/rosgraph_monitor/{name}", value)
            monitor = self.start("rosrun", "rosgraph_monitor", "monitor")
            _, stderr = monitor.communicate(timeout=40.0)
            self.assertEqual(monitor.returncode, 2, name)
            self.assertEqual(len(stderr.strip().splitlines()), 1, stderr)
            self.proxy.deleteParam("/test", f"/rosgraph_monitor/{name}")


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "monitor_master", MonitorMasterTest)
