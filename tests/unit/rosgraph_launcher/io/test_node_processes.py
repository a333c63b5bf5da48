"""Processes that stand by for Python nodes, with real processes."""

import os
import signal
import socket
from dataclasses import replace

import psutil
import pytest
from helpers.ports import QUIET_HOST
from helpers.waiting import wait_for
from rosgraph_launcher.io import processes
from rosgraph_launcher.io.master import NodeApi
from rosgraph_launcher.io.node_processes import MOST_LOST_WARM, NodeProcesses
from rosgraph_launcher.io.processes import Command
from rosgraph_launcher.launching.options import LauncherOptions


@pytest.fixture
def said():
    return []


@pytest.fixture
def nodes(tmp_path, said):
    owner = NodeProcesses(LauncherOptions(mark=f"test {tmp_path}"), said.append)
    yield owner
    owner.close()


@pytest.fixture
def prepared(monkeypatch):
    """The processes that were prepared, in their order."""
    found = []
    prepare = processes.prepare
    monkeypatch.setattr(processes, "prepare", lambda command: found.append(prepare(command)) or found[-1])
    return found


@pytest.fixture
def command(tmp_path):
    def make(name):
        script = tmp_path / name
        if not script.exists():  # a process that stands by for it may be about to run it
            script.write_text("#!/usr/bin/python3\n")
            script.chmod(0o755)
        return Command((str(script),), str(tmp_path), {"PATH": os.environ["PATH"], "MROS_LAUNCHER": f"test {tmp_path}"})

    return make


@pytest.fixture
def begun(nodes, command):
    """Names of two nodes that have begun."""
    for name in ("/a", "/b"):
        nodes.begin(name, command(name.strip("/")), None)
    return ["/a", "/b"]


LONG = 60.0  # s, which no test waits for


@pytest.fixture
def patient(tmp_path, said):
    """Nodes that have all the time that they want to end."""
    owner = NodeProcesses(LauncherOptions(f"test {tmp_path}", "", LONG, LONG), said.append)
    yield owner
    owner.close()


@pytest.fixture
def stubborn(patient, tmp_path):
    """Process id of the node /lidar, which heeds no SIGINT.

    It is one process: a shell that is stopped between vfork and exec of its child waits on, and is not told as stopped.
    """
    words = ("/bin/sh", "-c", "trap '' INT; : > heedless; exec sleep 1000")
    environment = {"PATH": os.environ["PATH"], "MROS_LAUNCHER": f"test {tmp_path}"}
    patient.begin("/lidar", Command(words, str(tmp_path), environment), None)
    wait_for((tmp_path / "heedless").exists, "it heeds no SIGINT")
    (process,) = patient._running.values()
    return process.pid


def test_node_that_is_stopped_is_killed_without_any_wait(patient, stubborn, said):
    pid = stubborn
    os.killpg(pid, signal.SIGSTOP)
    wait_for(lambda: psutil.Process(pid).status() == psutil.STATUS_STOPPED, "it is stopped")
    patient.ask_to_end(["/lidar"])
    patient.end(["/lidar"])
    assert f"node /lidar (process {pid}) is stopped: killing it" in said
    assert not psutil.pid_exists(pid)


def test_node_that_takes_calls_and_answers_none_is_killed_soon(patient, stubborn, said, monkeypatch):
    with socket.create_server((QUIET_HOST, 0)) as silent:
        uri = f"http://{QUIET_HOST}:{silent.getsockname()[1]}/"
        monkeypatch.setattr(NodeApi, "address", lambda name: uri)
        patient.ask_to_end(["/lidar"])
        patient.end(["/lidar"])
    assert said[-1].endswith("does not answer: killing it")


def test_node_that_the_kernel_holds_is_told_once_and_waited_for_in_the_background(nodes, command, said, debugger):
    nodes.begin("/held", replace(command("held"), words=("/bin/sleep", "1000")), None)
    nodes.begin("/other", replace(command("other"), words=("/bin/sleep", "1000")), None)
    pid = nodes._running["/held"].pid
    debugger(pid)
    nodes.end(["/held", "/other"], patience=False)
    told = f"process {pid} (/held) can't be ended: the kernel holds it"
    assert [line for line in said if "kernel" in line] == [told]
    nodes.take_ended()
    assert psutil.pid_exists(pid)
    debugger.end()
    wait_for(lambda: nodes.take_ended() or not psutil.pid_exists(pid), "its end is noticed")
    assert said.count(told) == 1


def test_processes_that_stand_by_are_started_one_by_one(nodes, prepared, begun):
    assert not nodes.stand_by(begun, may_start=False)
    assert [nodes.stand_by(begun, may_start=True) for _ in range(3)] == [True, True, False]
    assert len(prepared) == 2
    nodes.stand_by(begun[:1], may_start=False)
    assert prepared[0].status is None
    assert prepared[1].status is not None


def test_processes_stand_by_for_nodes_that_do_not_run_after_those_that_do(nodes, prepared, begun, command):
    nodes.expect([command("a"), command("c"), command("d")])  # a runs
    assert [nodes.stand_by(begun, may_start=True) for _ in range(5)] == [True, True, True, True, False]
    assert [process.status for process in prepared] == [None] * 4
    nodes.begin("/c", command("c"), nodes.prepare(command("c")))
    assert len(prepared) == 4  # it has taken the one that stood by
    nodes.expect([])
    nodes.stand_by(begun, may_start=False)
    assert prepared[3].status is not None


def test_only_so_many_processes_stand_by_for_nodes_that_do_not_run(tmp_path, said, prepared, command):
    owner = NodeProcesses(LauncherOptions(mark=f"test {tmp_path}", standby_others=1), said.append)
    owner.begin("/a", command("a"), None)
    owner.expect([command("c"), command("d")])
    assert [owner.stand_by(["/a"], may_start=True) for _ in range(3)] == [True, True, False]
    owner.close()


def test_nothing_stands_by_where_nothing_runs(nodes, prepared, begun, command):
    nodes.expect([command("c")])
    for _ in range(3):
        nodes.stand_by(begun, may_start=True)
    assert not nodes.stand_by((), may_start=False)
    assert all(process.status is not None for process in prepared)


def test_process_that_stands_by_is_replaced_only_so_often(nodes, prepared, begun):
    for _ in range(MOST_LOST_WARM):
        assert nodes.stand_by(begun[:1], may_start=True)
        prepared[-1].signal(signal.SIGKILL)
        wait_for(lambda: prepared[-1].status is not None, "it is gone")
    assert not nodes.stand_by(begun[:1], may_start=True)
    assert nodes.stand_by(begun, may_start=True)  # for the other node


def test_system_that_refuses_a_process_that_stands_by_is_asked_only_so_often(nodes, said, begun, monkeypatch):
    def refuse(_command):
        raise processes.StartError("no memory")

    monkeypatch.setattr(processes, "prepare", refuse)
    for _ in range(MOST_LOST_WARM + 2):
        assert not nodes.stand_by(begun[:1], may_start=True)
    assert said == ["no process stands by: no memory"] * MOST_LOST_WARM
