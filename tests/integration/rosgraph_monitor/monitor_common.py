"""What the monitor's tests share: diagnostics as they arrive, and nodes that are processes of their own."""

import os
import subprocess
import sys
import threading
import time
import unittest
from pathlib import Path

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from helpers.programs import program
from helpers.waiting import DEADLINE_S

SCRIPT = Path(__file__).parent / "monitor_node.py"
NODE = "import rospy, sys; rospy.init_node(sys.argv[1]); rospy.spin()"


class Diagnostics:
    """Keeps what came on /diagnostics, with the wall time of its arrival."""

    def __init__(self, topic="/diagnostics"):
        self._seen = []
        self._changed = threading.Condition()
        self._subscriber = rospy.Subscriber(topic, DiagnosticArray, self._receive, tcp_nodelay=True)

    def _receive(self, msg):
        with self._changed:
            self._seen.extend((time.monotonic(), status) for status in msg.status)
            self._changed.notify_all()

    def forget(self):
        with self._changed:
            self._seen.clear()

    def all(self):
        with self._changed:
            return [status for _, status in self._seen]

    def statuses(self, name, message):
        return [status for status in self.all() if (status.name, status.message) == (name, message)]

    def wait(self, what, condition, timeout=150.0):
        """Return arrival time and status of the first one that meets the condition since the last `forget`."""
        end = time.monotonic() + timeout
        with self._changed:
            while True:
                for at, status in self._seen:
                    if condition(status):
                        return at, status
                if not self._changed.wait(end - time.monotonic()):
                    seen = sorted({f"{s.name}: {s.message} {[v.value for v in s.values]}" for _, s in self._seen})
                    raise AssertionError(f"no {what} within {timeout} s; seen: {seen}")

    def wait_status(self, name, message, value=None, timeout=150.0):
        def fits(status):
            return (status.name, status.message) == (name, message) and (
                value is None or value in [entry.value for entry in status.values]
            )

        return self.wait(f"{message} {value or ''} of {name!r}", fits, timeout)


def run(name, *words, environment=None):
    """Run a command of the monitor's package."""
    return subprocess.run(
        [program("rosgraph_monitor", name), *words],
        env=os.environ | (environment or {}),
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def start_node(name, *, code=NODE, arguments=(), prefix=(), **options):
    """Start a node as a process."""
    return subprocess.Popen([*prefix, sys.executable, "-c", code, name, *arguments], **options)


class GraphTest(unittest.TestCase):
    """Tests of a monitor beside nodes whose interfaces are chosen; each begins with a graph as the model has it.

    A class gives NODES: full name -> what `monitor_node.py` takes.
    """

    NODES = {}

    @classmethod
    def setUpClass(cls):
        rospy.init_node("monitor_test", anonymous=True)
        cls.seen = Diagnostics()
        cls.nodes = {}

    @classmethod
    def tearDownClass(cls):
        for process in cls.nodes.values():
            end(process)

    @classmethod
    def start(cls, name, *interfaces):
        """Start a node, by default as the model has it, in place of the one of that name."""
        if name in cls.nodes:
            cls.nodes[name].terminate()  # it unregisters: what it was remains nowhere
            cls.nodes.pop(name).wait(DEADLINE_S)
        namespace, _, base = name.rpartition("/")
        cls.nodes[name] = subprocess.Popen(
            [sys.executable, str(SCRIPT), base, *(interfaces or cls.NODES.get(name, ()))],
            env=os.environ | {"ROS_NAMESPACE": namespace or "/"},
        )

    @classmethod
    def start_all(cls):
        for name in cls.NODES:
            cls.start(name)

    def setUp(self):
        self.expect_order()

    def expect_order(self):
        """Wait until all is as the model has it, and forget what was told before."""
        self.seen.forget()
        self.seen.wait_status("ROS Graph", "running OK", timeout=150.0)
        self.seen.forget()

    def restore(self, name):
        self.start(name)
        self.expect_order()


def end(process):
    """End a process for good."""
    process.kill()
    process.wait()


def value_of(status, key):
    """Return a value of a status by its key."""
    return next(entry.value for entry in status.values if entry.key == key)
