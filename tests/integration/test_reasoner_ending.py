"""The node reasoner ends when it is asked to, or when its master is lost, whatever it is doing; it leaves nothing."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import time
import xmlrpc.client
from pathlib import Path

import psutil
import pytest

PACKAGES = Path(__file__).parents[2] / "catkin_ws" / "src"
NODE = PACKAGES / "mros1_reasoner" / "nodes" / "reasoner"
MODEL = Path(__file__).parent / "reasoner" / "application.owl"
DEADLINE_S = 60.0
LAST = "/reasoner/save_knowledge_base"  # what it offers last, when it listens to all else


def wait_for(condition, what):
    until = time.monotonic() + DEADLINE_S
    while not (found := condition()):
        assert time.monotonic() < until, f"not within {DEADLINE_S:g} s: {what}"
        time.sleep(0.02)
    return found


def has_ended(child):
    """Tell whether a process has ended; where nobody inherits the children of others, it stays as a zombie."""
    try:
        return child.status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


@contextlib.contextmanager
def process(command, **options):
    started = subprocess.Popen(command, **options)
    try:
        yield started
    finally:
        started.kill()
        started.wait()


class World:
    """A master of the test's own, which can hang, and a reasoner that was started just now."""

    def __init__(self, stack, folder):
        with socket.socket() as probe:
            probe.bind(("localhost", 0))
            port = probe.getsockname()[1]
        self.uri = f"http://localhost:{port}"
        self._stack = stack
        self._environment = os.environ | {
            "ROS_MASTER_URI": self.uri,
            "ROS_HOME": str(folder),
            "ROS_LOG_DIR": str(folder),
        }
        self.master = self._start(["rosmaster", "--core", "-p", str(port)])
        wait_for(lambda: self.answers("getPid"), "the master")
        self.reasoner = self.start_reasoner()
        self.child = wait_for(lambda: psutil.Process(self.reasoner.pid).children(), "Pellet's process")[0]

    def start_reasoner(self, **environment):
        command = [sys.executable, str(NODE), f"_model_file:={MODEL}"]
        return self._start(command, stderr=subprocess.PIPE, text=True, env=self._environment | environment)

    def _start(self, command, **options):
        options = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "env": self._environment} | options
        return self._stack.enter_context(process(command, **options))

    def answers(self, call, *arguments):
        """Return what the master answers, None where it has nothing."""
        try:
            with xmlrpc.client.ServerProxy(self.uri) as master:
                code, _, value = getattr(master, call)("/test", *arguments)
        except OSError:
            return None
        return value if code == 1 else None

    def registrations(self):
        """Return the topics and services that the master still believes to be the reasoner's."""
        groups = wait_for(lambda: self.answers("getSystemState"), "the master's answer")
        return [name for group in groups for name, owners in group if "/reasoner" in owners]

    def reach(self, state):
        """Wait until the reasoner is in a state."""
        if state == "registers":
            wait_for(lambda: self.answers("lookupNode", "/reasoner"), "the reasoner's registration")
        elif state != "starts":
            wait_for(lambda: self.answers("lookupService", LAST), "the reasoner")
        if state == "is ignored by its master":
            self.master.send_signal(signal.SIGSTOP)

    def end(self):
        """Wait until the reasoner has ended well and left nothing behind; return what it said."""
        _, said = self.reasoner.communicate(timeout=DEADLINE_S)
        assert self.reasoner.returncode == 0, said
        assert "Traceback" not in said
        wait_for(lambda: has_ended(self.child), "the end of Pellet's process")
        return said


@pytest.fixture
def world(tmp_path):
    with contextlib.ExitStack() as stack:
        yield World(stack, tmp_path)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
@pytest.mark.parametrize("state", ["starts", "registers", "is ready", "is ignored by its master"])
def test_signal_ends_it(world, state, number):
    world.reach(state)
    world.reasoner.send_signal(number)
    world.end()
    if state != "is ignored by its master":
        assert not world.registrations()


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP], ids=["dies", "hangs"])
@pytest.mark.parametrize("state", ["registers", "is ready"])
def test_it_ends_with_its_master(world, state, number):
    world.reach(state)
    world.master.send_signal(number)
    assert world.end().count("master is gone") == 1


def test_request_over_its_own_interface_ends_it(world):
    world.reach("is ready")
    with xmlrpc.client.ServerProxy(world.answers("lookupNode", "/reasoner")) as node:
        node.shutdown("/test", "a request")
    world.end()
    assert not world.registrations()


def test_without_a_master_it_says_so_in_one_line_and_ends_with_2(world):
    lonely = world.start_reasoner(ROS_MASTER_URI="http://localhost:1")
    _, said = lonely.communicate(timeout=DEADLINE_S)
    assert lonely.returncode == 2
    assert said == "reasoner: no ROS master answers at http://localhost:1: start roscore or set ROS_MASTER_URI\n"
