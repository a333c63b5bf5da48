#!/usr/bin/env python3
"""The monitor when its master is silent, slow, spoilt or another one, or its parameters make no sense."""

import contextlib
import os
import signal
import socket
import subprocess
import threading
import time
import unittest
import xmlrpc.client

import rostest
from helpers.ports import QUIET_HOST, reserved_port
from helpers.programs import program
from helpers.waiting import wait_for


def answers(master):
    try:
        return master.getPid("/test")[0] == 1
    except OSError:
        return False


class Proxy:
    """Stands between a node and its master, and delays, spoils or swallows the master's answers.

    `mode` is "pass", "slow", "garbage" or "silent"; `passed` and `swallowed` count pieces of answers.
    """

    def __init__(self, master_port):
        self.mode = "pass"
        self.passed = self.swallowed = 0
        self.master_port = master_port
        self._open = []
        self._server = socket.create_server((QUIET_HOST, 0))
        self.uri = f"http://{QUIET_HOST}:{self._server.getsockname()[1]}"
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self):
        with contextlib.suppress(OSError):
            while True:
                client, _ = self._server.accept()
                master = socket.create_connection(("127.0.0.1", self.master_port))
                self._open += [client, master]
                threading.Thread(target=self._pump, args=(client, master), daemon=True).start()
                threading.Thread(target=self._pump, args=(master, client, True), daemon=True).start()

    def _pump(self, source, target, to_client=False):
        with source, target, contextlib.suppress(OSError):
            while data := source.recv(65536):
                if to_client and self.mode == "slow":
                    time.sleep(0.05)
                if to_client and self.mode == "garbage":
                    data = b"HTTP/1.1 200 OK\r\nContent-Length: 7\r\n\r\ngarbage"
                if to_client and self.mode == "silent":
                    self.swallowed += 1
                else:
                    target.sendall(data)
                    self.passed += to_client

    def drop(self):
        """Close all connections; new ones are let through."""
        for end in self._open:
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def close(self):
        self._server.close()


READY = (1, "/rosgraph_manipulator/active_configuration")
"""What the monitor registers last."""
PATHS = ("desired_rossystem", "ros_models")


class MonitorMasterTest(unittest.TestCase):
    def setUp(self):
        port = self.enterContext(reserved_port())
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
        self.master = xmlrpc.client.ServerProxy(self.uri)
        wait_for(lambda: answers(self.master), "the master answers")
        return master

    def start_proxy(self):
        proxy = Proxy(self.master_port)
        self.addCleanup(proxy.close)
        self.environment["ROS_MASTER_URI"] = proxy.uri
        return proxy

    def registered(self, part, name):
        return any(name == entry[0] for entry in self.master.getSystemState("/test")[2][part])

    def start_monitor(self, until=READY, namespace="/"):
        """Start it, and wait until it has registered a service (2), or a subscription (1)."""
        monitor = self.start(program("rosgraph_monitor", "monitor"), f"__ns:={namespace}")
        if until:
            wait_for(lambda: self.registered(*until), "the registrations")
        return monitor

    def expect_end(self, process, *words, status=0):
        """Wait until it has ended, with one line on stderr that holds these words, or none where there are none.

        A master on a busy machine falls silent for a while, too, which is told each time; those lines count once, or
        not where another one is expected.
        """
        _, stderr = process.communicate(timeout=150.0)
        self.assertEqual(process.returncode, status, stderr)
        lines = {line.partition(": ")[2] for line in stderr.strip().splitlines()}
        borne = {line for line in lines if "it ends if that lasts" in line}
        told = lines if len(lines) == 1 and words else lines - borne
        self.assertEqual(len(told), bool(words), stderr)
        for word in words:
            self.assertIn(word, "".join(told))

    def test_other_master_at_the_same_address_ends_the_monitor(self):
        self.start_master()
        proxy = self.start_proxy()
        monitor = self.start_monitor()
        port = self.enterContext(reserved_port())
        self.start("rosmaster", "--core", "-p", str(port))
        wait_for(lambda: answers(xmlrpc.client.ServerProxy(f"http://localhost:{port}")), "the master answers")
        proxy.master_port = port
        proxy.drop()
        self.expect_end(monitor, "another one")

    def test_stopped_master_is_said_in_one_line_and_ends_the_monitor(self):
        master = self.start_master()
        self.master.setParam("/test", "/rosgraph_monitor/master_patience", 1.0)
        monitor = self.start_monitor()
        master.send_signal(signal.SIGSTOP)
        self.expect_end(monitor, "does not answer")

    def test_master_that_falls_silent_while_the_monitor_registers_ends_it(self):
        self.start_master()
        proxy = self.start_proxy()
        monitor = self.start_monitor(until=None)
        wait_for(lambda: proxy.passed, "a request passes")
        proxy.mode = "silent"
        self.expect_end(monitor, "does not answer")

    def test_signal_ends_the_monitor_while_it_registers(self):
        self.start_master()
        proxy = self.start_proxy()
        monitor = self.start_monitor(until=None)
        wait_for(lambda: proxy.passed, "a request passes")
        proxy.mode = "silent"
        wait_for(lambda: proxy.swallowed, "a request is swallowed")
        monitor.terminate()
        monitor.communicate(timeout=150.0)
        self.assertIn(monitor.returncode, (0, -signal.SIGTERM))

    def test_slow_master_is_no_problem_and_one_that_answers_garbage_is_told_and_forgiven(self):
        self.start_master()
        proxy = self.start_proxy()
        proxy.mode = "slow"
        monitor = self.start_monitor()
        proxy.mode = "garbage"
        lines = iter(monitor.stderr.readline, "")  # a silence of the slow master may be told before
        self.assertTrue(any("garbage" in line for line in lines))
        proxy.mode = "pass"
        before = proxy.passed
        wait_for(lambda: proxy.passed > before + 20, "requests pass")  # looks at the graph, and more
        monitor.terminate()
        self.expect_end(monitor)

    def test_bad_parameters_are_said_in_one_line(self):
        self.start_master()
        bad = {
            "rate": -1.0,
            "components": ["front_laser"],
            "desired_rossystem": "/nowhere/base.rossystem",
            "observers": 7,
            "topics": {"front/scan": {"min_rate": "fast"}},
            "ros_models": ["/nowhere/laser.ros"],
        }
        for name, value in bad.items():
            self.master.setParam("/test", f"/{name}/rosgraph_monitor/{name}", value)
        monitors = {name: self.start_monitor(until=None, namespace=f"/{name}") for name in bad}
        for name, monitor in monitors.items():
            self.expect_end(monitor, name if name not in PATHS else "/nowhere", status=2)


if __name__ == "__main__":
    rostest.rosrun("metacontrol_tests", "monitor_master", MonitorMasterTest)
