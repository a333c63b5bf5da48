"""Our nodes end in time whatever they are at: told to, without a master, with one that hangs or dies.

All nodes of a test start side by side at one master. Most of what a test costs is their start and their waiting.
"""

import contextlib
import os
import select
import signal
import socket
import struct
import subprocess
import sys
import threading
import xmlrpc.client
from pathlib import Path

import psutil
import pytest
import yaml
from helpers.cases import case
from helpers.ports import QUIET_HOST, reserved_port
from helpers.waiting import DEADLINE_S, wait_for

HERE = Path(__file__).resolve().parent
INTEGRATION = HERE.parent
PACKAGES = HERE.parents[2] / "catkin_ws" / "src"
SERVER = str(INTEGRATION / "rosgraph_manipulator" / "data" / "server.launch")
MODEL = INTEGRATION / "mros1_reasoner" / "data" / "application.owl"
NODES = {  # its package, and a service or topic that it offers, or listens to, late in its start
    "rosgraph_monitor/monitor": "/rosgraph_manipulator/active_configuration",
    "rosgraph_monitor/diagnostic_names": "/diagnostics",
    "mros1_reasoner/reasoner": "/reasoner/save_knowledge_base",
    "rosgraph_launcher/rosgraph_launcher": "/rosgraph_launcher/change",
    "rosgraph_manipulator/rosgraph_manipulator": "/rosgraph_manipulator_action_server/status",
    "rosgraph_manipulator/action_relay": "/a/status",
    "move_base/move_base": "/move_base/status",
    "metacontrol_sim/simulator": "/simulator/set_light",
    "metacontrol_sim/front_laser": "/front/scan",
    "metacontrol_experiments/contingencies": "/mission/event",
}
BORNE = "it ends if that lasts"
"""Said of each silence of the master, also of a short one on a busy machine."""
NAMES = {"monitor": "rosgraph_monitor", "contingencies": "mission_contingencies"}
PARAMETERS = {
    "/configurations": {"slow": {"launch": SERVER}},
    "/rosgraph_manipulator": {"launcher_timeout": 0.1},
    "/action_relay": {"action": "a", "server": "b", "type": "actionlib/TestAction"},
    "/move_base": yaml.safe_load((PACKAGES / "metacontrol_sim" / "config" / "move_base.yaml").read_text()),
    "/reasoner": {"model_file": str(MODEL)},
    "/simulator": {"initial_pose_x": -8.0, "initial_pose_y": -8.0},
}


def has_ended(child):
    """Tell whether a process has ended; where nobody inherits the children of others, it stays as a zombie."""
    try:
        return child.status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


def about_master(said):
    """Return the lines that tell of the master."""
    return [line for line in said.splitlines() if "ROS master" in line]


class Gate:
    """Stands between a node and the master, and closes for ever after so many answers: as if the master had died."""

    def __init__(self, master_port, answers):
        self._master_port, self._left = master_port, answers
        self._sockets = []
        self._lock = threading.Lock()
        self._server = socket.create_server((QUIET_HOST, 0))
        self.uri = f"http://{QUIET_HOST}:{self._server.getsockname()[1]}"
        self.closed = threading.Event()
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self):
        with contextlib.suppress(OSError):
            while True:
                client, _ = self._server.accept()
                master = socket.create_connection(("localhost", self._master_port))
                with self._lock:
                    self._sockets += [client, master]
                threading.Thread(target=self._pump, args=(client, master), daemon=True).start()
                threading.Thread(target=self._pump, args=(master, client, True), daemon=True).start()

    def _pump(self, source, target, to_client=False):
        with contextlib.suppress(OSError):
            while data := source.recv(65536):
                target.sendall(data)
                if to_client:
                    with self._lock:
                        self._left -= 1
                        is_last = self._left == 0
                    if is_last:
                        self.close()

    def close(self):
        self.closed.set()
        with self._lock:
            sockets = [self._server, *self._sockets]
        for end in sockets:
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()


class World:
    """A master of the test's own, and nodes that join it."""

    def __init__(self, folder, stack):
        self.port = stack.enter_context(reserved_port())
        self.uri = f"http://localhost:{self.port}"
        self.master = xmlrpc.client.ServerProxy(self.uri)
        self._folder, self._stack = folder, stack
        self._children = {}

    def start_master(self, parameters=None):
        words = [sys.executable, "-c", f"import rosmaster; rosmaster.rosmaster_main(['--core', '-p', '{self.port}'])"]
        process = self._start("master", words)
        wait_for(lambda: self.ask("getPid"), "the master answers")
        for name, value in {**PARAMETERS, **(parameters or {})}.items():
            self.ask("setParam", name, value)
        return process

    def start(self, node, uri=None, stderr=None):
        """Start a node."""
        package, _, script = node.partition("/")
        return self._start(node, [sys.executable, str(PACKAGES / package / "nodes" / script)], uri, stderr)

    def _start(self, name, words, uri=None, stderr=None):
        own = {"ROS_MASTER_URI": uri or self.uri, "ROS_LOG_DIR": str(self._folder), "ROS_HOME": str(self._folder)}
        with open(self._path(name), "w") as output:
            process = subprocess.Popen(
                words,
                env={**os.environ, **own, "PYTHONUNBUFFERED": "1"},
                stdout=subprocess.DEVNULL,  # what is said is said on stderr
                stderr=stderr or output,
            )
        self._stack.callback(process.wait)
        self._stack.callback(process.kill)
        return process

    def _path(self, name):
        return self._folder / f"{name.rpartition('/')[2]}.txt"

    def ask(self, call, *arguments):
        """Return what the master answers, None where it has nothing."""
        with contextlib.suppress(OSError):
            with xmlrpc.client.ServerProxy(self.uri) as master:
                code, _, value = getattr(master, call)("/test", *arguments)
            return value if code == 1 else None
        return None

    def registrations(self, node):
        """Return the topics and services that the master believes to be a node's."""
        name = node.rpartition("/")[2]
        owner = f"/{NAMES.get(name, name)}"
        groups = wait_for(lambda: self.ask("getSystemState"), "the master's answer")
        return {name for group in groups for name, owners in group if owner in owners}

    def start_until_ready(self, node, **options):
        process = self.start(node, **options)
        self.wait_until_ready(node)
        return process

    def wait_until_ready(self, node):
        wait_for(
            lambda: NODES[node] in self.registrations(node),
            lambda: f"{node} is ready; it has {self.registrations(node)} and says {self.said(node)}",
        )

    def start_all(self):
        """Start all nodes side by side, and wait until they are ready; return their processes by their names."""
        processes = {node: self.start(node) for node in NODES}
        for node in NODES:
            self.wait_until_ready(node)
        return processes

    def start_behind_gates(self, answers):
        """Start all nodes side by side, each behind a gate that closes after so many answers of the master."""
        gates = {node: Gate(self.port, answers) for node in NODES}
        return {node: (self.start(node, gate.uri), gate) for node, gate in gates.items()}

    def said(self, node):
        return self._path(node).read_text()

    def expect_end(self, node, process, status=0):
        """Wait until a node has ended well, and with it its processes; return what it said."""
        try:
            process.wait(DEADLINE_S)
        except subprocess.TimeoutExpired:
            pytest.fail(f"{node} goes on: {self.said(node)}")
        said = self.said(node)
        assert "Traceback" not in said, said
        assert process.returncode == status, said
        return said


@pytest.fixture
def world(tmp_path):
    with contextlib.ExitStack() as stack:
        yield World(tmp_path, stack)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
def test_signal_ends_them_and_they_unregister(world, number):
    world.start_master()
    for node, process in world.start_all().items():
        with case(node):
            children = psutil.Process(process.pid).children()
            process.send_signal(number)
            said = world.expect_end(node, process)
            assert not [line for line in about_master(said) if BORNE not in line], said
            assert not world.registrations(node)
            wait_for(lambda: all(map(has_ended, children)), "the end of its processes")  # noqa: B023


def test_request_over_its_own_interface_ends_them(world):
    world.start_master()
    for node, process in world.start_all().items():
        with case(node):
            name = node.rpartition("/")[2]
            address = world.ask("lookupNode", f"/{NAMES.get(name, name)}")
            with contextlib.suppress(OSError), xmlrpc.client.ServerProxy(address) as api:
                api.shutdown("/test", "a request")  # it may end before it has answered
            world.expect_end(node, process)
            assert not world.registrations(node)


@pytest.mark.parametrize("answers", [1, 4])
def test_signal_ends_them_while_they_start(world, answers):
    world.start_master()
    started = world.start_behind_gates(answers)
    for process, gate in started.values():
        assert gate.closed.wait(DEADLINE_S)
        process.send_signal(signal.SIGTERM)
    for node, (process, _) in started.items():
        with case(node):
            world.expect_end(node, process)


def test_signal_ends_them_while_their_master_hangs(world):
    master = world.start_master()
    processes = world.start_all()
    master.send_signal(signal.SIGSTOP)
    for process in processes.values():
        process.send_signal(signal.SIGTERM)
    for node, process in processes.items():
        with case(node):
            world.expect_end(node, process)


def test_signal_ends_them_while_they_wait_for_the_first_answer(world):
    with contextlib.ExitStack() as stack:
        silent = {node: stack.enter_context(socket.create_server((QUIET_HOST, 0))) for node in NODES}
        processes = {node: world.start(node, f"http://{QUIET_HOST}:{s.getsockname()[1]}") for node, s in silent.items()}
        waiting = {server.fileno(): node for node, server in silent.items()}
        while waiting:  # each is told as soon as it waits: it does not wait for ever
            connected, _, _ = select.select(waiting, [], [], DEADLINE_S)
            assert connected, f"no connection of {', '.join(waiting.values())}"
            for node in map(waiting.pop, connected):
                stack.enter_context(silent[node].accept()[0])
                processes[node].send_signal(signal.SIGTERM)
        for node, process in processes.items():
            with case(node):
                world.expect_end(node, process)


def test_master_that_dies_is_told_in_one_line(world):
    master = world.start_master()
    processes = world.start_all()
    children = {node: psutil.Process(process.pid).children() for node, process in processes.items()}
    master.kill()
    for node, process in processes.items():
        with case(node):
            assert world.expect_end(node, process).count(f"ROS master {world.uri} is gone") == 1
            wait_for(lambda: all(map(has_ended, children[node])), "the end of its processes")  # noqa: B023


def test_master_that_dies_ends_it_though_nobody_reads_what_it_says(world):
    master = world.start_master()
    node = "rosgraph_manipulator/action_relay"
    reader, writer = os.pipe()
    with os.fdopen(reader), os.fdopen(writer, "w") as stderr:
        process = world.start_until_ready(node, stderr=stderr)
    master.kill()
    world.expect_end(node, process)


@pytest.mark.parametrize("answers", [1, 3, 8, 15])
def test_master_that_dies_while_they_start_is_told_in_one_line(world, answers):
    world.start_master()
    for node, (process, gate) in world.start_behind_gates(answers).items():
        with case(node):
            said = world.expect_end(node, process)
            assert said.count(f"ROS master {gate.uri} is gone") == 1, said


def test_master_that_hangs_is_told_in_one_line_and_ends_them(world):
    master = world.start_master()
    processes = world.start_all()
    before = {node: len(about_master(world.said(node))) for node in NODES}
    master.send_signal(signal.SIGSTOP)
    for node, process in processes.items():
        with case(node):
            said = world.expect_end(node, process)
            told = about_master(said)
            assert told and f"ROS master {world.uri} does not answer" in told[-1], said
            assert len(told) <= before[node] + 1, said


def test_without_a_master_they_say_so_in_one_line_and_end_with_2(world):
    processes = {node: world.start(node) for node in NODES}
    for node, process in processes.items():
        with case(node):
            said = world.expect_end(node, process, status=2)
            name = node.rpartition("/")[2]
            line = (
                f"{NAMES.get(name, name)}: no ROS master answers at {world.uri}: start roscore or set ROS_MASTER_URI\n"
            )
            assert [said for said in said.splitlines(True) if not said.startswith("pybullet build")] == [line]


def asks_for(service):
    """Return what a TCPROS client says first that wants to know whether a service is there."""
    fields = [f"service={service}", "md5sum=*", "callerid=/test", "probe=1"]
    header = b"".join(struct.pack("<I", len(field)) + field.encode() for field in fields)
    return struct.pack("<I", len(header)) + header


def test_client_that_says_nothing_or_nonsense_keeps_nobody_out(world):
    world.start_master()
    world.start_all()
    for node in NODES:
        with case(node), contextlib.ExitStack() as stack:
            service = next(name for name in sorted(world.registrations(node)) if name.endswith("/get_loggers"))
            address = world.ask("lookupService", service)
            host, _, port = address.removeprefix("rosrpc://").rpartition(":")
            connect = lambda: stack.enter_context(socket.create_connection((host, int(port)), DEADLINE_S))  # noqa: B023, E731
            silent, mistaken = connect(), connect()
            mistaken.sendall(b"POST /RPC2 HTTP/1.1\r\n\r\n")
            client = connect()
            client.sendall(asks_for(service))
            assert client.recv(4096), "the service does not answer"
            assert silent.recv(1) == mistaken.recv(1) == b"", "the node waits for ever"


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT], ids=lambda number: number.name)
def test_manipulator_ends_when_told_to_though_its_launcher_hangs(world, number):
    node = "rosgraph_manipulator/rosgraph_manipulator"
    world.start_master({"/rosgraph_manipulator/initial_configuration": "slow"})
    launcher = world.start_until_ready("rosgraph_launcher/rosgraph_launcher")
    launcher.send_signal(signal.SIGSTOP)
    process = world.start(node)
    wait_for(lambda: "rosgraph_launcher is not there" in world.said(node), "it asks the launcher")
    process.send_signal(number)
    world.expect_end(node, process)
