"""Commands end with one line, whatever their master does."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path
from xmlrpc.client import ServerProxy
from xmlrpc.server import SimpleXMLRPCServer

import pytest
from helpers.ports import reserved_port
from helpers.waiting import DEADLINE_S, wait_for

PACKAGES = Path(__file__).resolve().parents[3] / "catkin_ws" / "src"
COMMANDS = {
    "explain": ("mros1_reasoner", "explain"),
    "plan": ("rosgraph_manipulator", "plan", "a", "b"),
    "request": ("rosgraph_manipulator", "request", "a"),
    "release": ("rosgraph_manipulator", "release", "f"),
    "status": ("rosgraph_manipulator", "status"),
    "snapshot": ("rosgraph_monitor", "snapshot"),
    "watch": ("rosgraph_monitor", "watch", "--once", "1"),
}
NODES = {name: COMMANDS[name] for name in COMMANDS if name not in ("snapshot", "watch")}


@contextlib.contextmanager
def master(answers):
    """Stand in for a master: it answers so many calls, and accepts all others without an answer. Gives its address."""
    left, end = [answers], threading.Event()

    class Calls:
        def _dispatch(self, method, _):
            if left[0] == 0 or method != "getPid":
                end.wait()
            left[0] -= 1
            return [1, "", os.getpid()]

    with SimpleXMLRPCServer(("localhost", 0), logRequests=False) as server:
        server.socket.listen(20)
        server.register_instance(Calls())
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        try:
            yield f"http://localhost:{server.server_address[1]}"
        finally:
            end.set()
            server.shutdown()
            thread.join()


def ends(commands, uri, folder):
    """Run commands at the same time; return their exit statuses and what they say on stderr."""
    own = {"ROS_MASTER_URI": uri, "ROS_LOG_DIR": str(folder), "ROS_HOME": str(folder)}
    processes = {}
    with contextlib.ExitStack() as stack:
        for name, (package, script, *arguments) in commands.items():
            process = subprocess.Popen(
                [sys.executable, str(PACKAGES / package / "nodes" / script), *arguments],
                env={**os.environ, **own},
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
            )
            stack.callback(process.wait)
            stack.callback(process.kill)
            processes[name] = process
        said = {name: process.communicate(timeout=DEADLINE_S)[1] for name, process in processes.items()}
        return {name: (process.returncode, said[name]) for name, process in processes.items()}


@pytest.mark.parametrize("commands, answers", [(COMMANDS, 0), (NODES, len(NODES))], ids=["never", "at_first"])
def test_master_that_does_not_answer_is_told_in_one_line(tmp_path, commands, answers):
    with master(answers) as uri:
        found = ends(commands, uri, tmp_path)
    for name, (status, said) in found.items():
        assert status == 2, (name, said)
        assert "does not answer" in said and said.count("\n") == 1, (name, said)


NEVER_LOOKS = """
import threading, rospy.core, rospy.impl.registration as registration
rospy.core._TIMEOUT_SHUTDOWN_JOIN = None
registration.RegManager.run = lambda _: threading.Event().wait()
from node_kit.ros import command
command.join("command")
"""


@contextlib.contextmanager
def real_master(folder):
    """Start a master; give the environment of its nodes."""
    with reserved_port() as port:
        core = f"import rosmaster; rosmaster.rosmaster_main(['--core', '-p', '{port}'])"
        own = {"ROS_MASTER_URI": f"http://localhost:{port}", "ROS_LOG_DIR": str(folder), "ROS_HOME": str(folder)}
        environment = {**os.environ, **own}
        with subprocess.Popen([sys.executable, "-c", core], env=environment, stdout=subprocess.DEVNULL) as process:
            try:
                wait_for(lambda: answers(port), "the master is there")
                yield environment
            finally:
                process.kill()


def test_command_does_not_wait_for_rospys_threads_at_its_end(tmp_path):
    with real_master(tmp_path) as environment:
        words = [sys.executable, "-c", NEVER_LOOKS]
        assert subprocess.run(words, env=environment, timeout=DEADLINE_S, check=False).returncode == 0


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("command", [("rosgraph_monitor", "watch"), ("mros1_reasoner", "feasible", "--wait", "600")])
def test_command_that_is_asked_to_end_leaves_the_graph(tmp_path, command, number):
    package, script, *arguments = command
    with real_master(tmp_path) as environment, ServerProxy(environment["ROS_MASTER_URI"]) as graph:

        def nodes():
            return {node for part in graph.getSystemState("/test")[2] for _, names in part for node in names}

        words = [sys.executable, str(PACKAGES / package / "nodes" / script), *arguments]
        with subprocess.Popen(words, env=environment, stdout=subprocess.DEVNULL) as process:
            wait_for(nodes, "it is in the graph")
            process.send_signal(number)
            assert process.wait(DEADLINE_S) == 128 + number
        assert not nodes()


SWALLOWS = """
import time
from node_kit.ros.command import leaving_by_signals

def wait():
    while True:
        time.sleep(0.01)  # a signal just before a long sleep would be seen at its end

with leaving_by_signals():
    pass
try:
    try:
        print("ready", flush=True)
        wait()
    except:
        print("swallowed", flush=True)
    wait()
finally:
    print("in order", flush=True)
"""


def test_signal_that_is_swallowed_comes_again():
    with subprocess.Popen([sys.executable, "-c", SWALLOWS], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "ready\n"
        process.terminate()
        said, _ = process.communicate(timeout=DEADLINE_S)
    assert process.returncode == 128 + signal.SIGTERM
    assert said == "swallowed\nin order\n"


def answers(port):
    with contextlib.suppress(OSError), socket.create_connection(("localhost", port)):
        return True
    return False
