"""Looking up, with real processes, who answers under a node's name."""

import errno
import os
import subprocess
import sys
from io import BytesIO

import pytest
from metacontrol_msgs.msg import LaunchedFunctions
from rosgraph_launcher.io import ownership
from rosgraph_launcher.io.processes import MARK, OWNER
from rosgraph_launcher.launching.ownership import Owner
from rosgraph_launcher.launching.report import LauncherReport
from rosgraph_launcher.ros.node_messages import report_message

LAUNCHER = "http://localhost:11311/rosgraph_launcher"
NODE = "import os, socket, sys; s = socket.create_server(('127.0.0.1', 0)); print(s.getsockname()[1], os.getpid())"
SERVES = [sys.executable, "-c", f"{NODE}; sys.stdout.flush(); sys.stdin.read()"]


@pytest.fixture
def answer(monkeypatch):
    """Have a node answer with an address and a process id."""

    def have(address, pid):
        monkeypatch.setattr(ownership.NodeApi, "answer", lambda _name: (address, pid))

    monkeypatch.setattr(ownership.NodeApi, "answer", lambda _name: None)
    return have


@pytest.fixture
def serve():
    """Start a process that serves a port; return both."""
    started = []

    def begin(words, mark):
        environment = {**os.environ, MARK: mark}
        process = subprocess.Popen(
            words, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
        )
        started.append(process)
        return map(int, process.stdout.readline().split())

    yield begin
    for process in started:
        process.communicate("")


def owner():
    return ownership.look_up("/n").owner(LAUNCHER)


def test_nobody_answers(answer):
    assert owner() is Owner.NOBODY


def test_process_with_the_mark_is_the_launchers(answer, serve):
    port, pid = serve(SERVES, LAUNCHER)
    answer(f"http://localhost:{port}/", pid)
    assert owner() is Owner.LAUNCHER


def test_child_that_lost_the_mark_is_the_launchers(answer, serve):
    shell = ["/bin/sh", "-c", 'env -u MROS_LAUNCHER "$@"; true', "sh", *SERVES]
    port, pid = serve(shell, LAUNCHER)
    assert MARK == "MROS_LAUNCHER"
    answer(f"http://localhost:{port}/", pid)
    assert owner() is Owner.LAUNCHER


def test_process_of_somebody_else_is_foreign(answer, serve):
    port, pid = serve(SERVES, "")
    answer(f"http://localhost:{port}/", pid)
    assert owner() is Owner.FOREIGN
    assert f"process {pid} " in ownership.look_up("/n").conflict(LAUNCHER)


def test_command_line_that_is_no_utf_8_fits_into_a_message(answer, serve):
    port, pid = serve([sys.executable, "-X", b"m\xfcller", *SERVES[1:]], "")
    answer(f"http://localhost:{port}/", pid)
    conflict = ownership.look_up("/n").conflict(LAUNCHER)
    assert r"m\xfcller" in conflict
    LaunchedFunctions(functions=[report_message(LauncherReport("f", message=conflict))]).serialize(BytesIO())


def test_process_that_does_not_serve_the_port_cannot_be_compared(answer, serve):
    port, _ = serve(SERVES, "")
    answer(f"http://localhost:{port}/", os.getpid())  # the number that a node in a container says
    assert owner() is Owner.UNKNOWN


@pytest.mark.parametrize("address", ["http://192.0.2.1:1234/", "http://no-such-host.invalid:1234/"])
def test_process_of_another_host_cannot_be_compared(answer, address):
    answer(address, os.getpid())
    assert owner() is Owner.UNKNOWN


@pytest.mark.parametrize("pid", [-1, 2**31 - 1])
def test_number_that_is_no_process_cannot_be_compared(answer, pid):
    answer("http://localhost:1234/", pid)
    found = ownership.look_up("/n")
    assert (found.answers, found.address, found.lineage) == (True, "http://localhost:1234/", ())
    assert owner() is Owner.UNKNOWN


@pytest.mark.parametrize("call", ["environ", "parent", "net_connections"])
def test_process_is_unknown_while_no_descriptor_is_left(answer, serve, monkeypatch, call):
    def refuse(*_):
        raise OSError(errno.EMFILE, "Too many open files")

    port, pid = serve(SERVES, "" if call != "environ" else LAUNCHER)
    answer(f"http://localhost:{port}/", pid)
    if call == "net_connections" and not hasattr(ownership.psutil.Process, call):
        call = "connections"
    monkeypatch.setattr(ownership.psutil.Process, call, refuse)
    assert owner() is Owner.UNKNOWN
    monkeypatch.undo()


def test_process_names_the_launcher_that_started_it(answer, serve, monkeypatch):
    monkeypatch.setenv(OWNER, "7@1.5")
    port, pid = serve(SERVES, LAUNCHER)
    answer(f"http://localhost:{port}/", pid)
    found = ownership.look_up("/n")
    assert found.may_be_of(LAUNCHER, "7@1.5")
    assert not found.may_be_of(LAUNCHER, "8@1.5")


def test_host_that_the_name_service_did_not_know_is_asked_about_again(monkeypatch):
    known, now = [set(), {"127.0.1.1"}], [0.0]
    monkeypatch.setattr(ownership, "resolved", lambda _host: known.pop(0))
    monkeypatch.setattr(ownership.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(ownership, "_hosts", {})
    assert not ownership.is_this_host("robot.local")
    assert not ownership.is_this_host("robot.local")  # nobody is asked: that may take seconds
    now[0] += ownership.NO_LASTS
    assert ownership.is_this_host("robot.local")
    now[0] += ownership.NO_LASTS
    assert ownership.is_this_host("robot.local")  # for good
