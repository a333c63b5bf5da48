"""Processes that stand by for Python nodes, with real processes."""

import os
import signal
import socket
import subprocess
from dataclasses import replace

import psutil
import pytest
from helpers.ports import QUIET_HOST
from helpers.waiting import wait_for
from rosgraph_launcher.io import node_processes, processes
from rosgraph_launcher.io.master import NodeApi
from rosgraph_launcher.io.node_processes import MOST_LOST_WARM, NodeProcesses
from rosgraph_launcher.io.processes import OWNER, Command
from rosgraph_launcher.launching.options import LauncherOptions
from rosgraph_launcher.launching.ownership import Answer, ProcessFacts


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


def test_node_that_another_user_runs_is_told_and_followed_until_it_ends(nodes, command, said, monkeypatch):
    nodes.begin("/laser", replace(command("laser"), words=("/bin/sleep", "1000")), None)
    process = nodes._running["/laser"]

    def refuse(group, number):
        raise PermissionError(1, "Operation not permitted")

    with monkeypatch.context() as moment:
        moment.setattr(processes.os, "killpg", refuse)
        nodes.end(["/laser"], patience=False)
    assert said[-1] == f"process {process.pid} (/laser) can't be ended: {node_processes.FOREIGN}"
    assert nodes._held == [process]
    process.signal(signal.SIGKILL)
    wait_for(lambda: nodes.take_ended() or not nodes._held, "its end is noticed")


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


def stop(process):
    process.signal(signal.SIGSTOP)
    wait_for(lambda: process.is_stopped, "it is stopped")


def test_process_that_stands_by_and_is_stopped_is_not_taken(nodes, prepared, begun, command):
    nodes.stand_by(begun[:1], may_start=True)
    stop(prepared[0])
    taken = nodes.prepare(command("a"))
    assert prepared[0].status == -signal.SIGKILL
    assert taken is prepared[1]
    nodes.discard(taken)


def test_prepared_process_that_is_stopped_is_not_begun(nodes, command, said):
    process = nodes.prepare(command("a"))
    stop(process)
    nodes.begin("/a", command("a"), process)
    assert process.status == -signal.SIGKILL
    assert nodes._running["/a"] is not process
    assert said == ["node /a starts without imports in advance: the process that stood by is stopped"]


def test_node_gets_sigint_where_there_is_no_thread_to_ask_it(nodes, command, said, no_thread):
    nodes.begin("/n", replace(command("n"), words=("/bin/sleep", "1000")), None)
    (process,) = nodes._running.values()
    left = no_thread()
    nodes.ask_to_end(["/n"])
    assert not left
    wait_for(lambda: process.status == -signal.SIGINT, "it has ended")
    assert said == ["node /n is ended by SIGINT: can't start new thread"]


def test_close_leaves_the_processes_of_a_successor_alone(nodes, command, begun):
    environment = command("a").environment
    successor = subprocess.Popen(["sleep", "1000"], env={**environment, OWNER: "1@2.5"})
    own = list(nodes._running.values())
    try:
        wait_for(lambda: psutil.Process(successor.pid).environ().get(OWNER) == "1@2.5", "it runs")
        nodes.close()
        assert successor.poll() is None
        assert all(process.popen.wait() is not None for process in own)
    finally:
        successor.kill()
        successor.wait()


def test_close_leaves_the_rest_to_the_reaper_while_no_descriptor_is_left(nodes, monkeypatch, said):
    def refuse(*_):
        raise OSError("Too many open files")

    with monkeypatch.context() as moment:
        moment.setattr(processes, "kill_marked", refuse)
        nodes.close()
    assert nodes._reaper.poll() is None


@pytest.mark.parametrize(("launcher", "is_asked"), [("1@2.5", False), ("", True)])
def test_node_of_a_successor_is_not_asked_to_end(nodes, command, monkeypatch, launcher, is_asked):
    asked = []
    mark = command("a").environment[processes.MARK]
    found = Answer(True, True, (ProcessFacts(1, "node", mark, launcher),), "http://localhost:1/")
    monkeypatch.setattr(NodeApi, "address", lambda _name: found.address)
    monkeypatch.setattr(NodeApi, "ask_pid", lambda _uri: 1)
    monkeypatch.setattr(NodeApi, "request_shutdown", lambda name, _reason: asked.append(name) or True)
    monkeypatch.setattr(node_processes, "look_up", lambda _name: found)
    nodes.begin("/a", replace(command("a"), words=("/bin/true",)), None)
    (process,) = nodes._running.values()
    nodes._ask_to_end("/a", process)
    assert asked == (["/a"] if is_asked else [])


def test_node_that_its_launch_prefix_runs_as_another_user_is_asked_to_end(nodes, command, monkeypatch):
    asked = []
    nodes.begin("/a", replace(command("a"), words=("/bin/true",)), None)
    (process,) = nodes._running.values()
    lineage = (ProcessFacts(1, "node"), ProcessFacts(process.pid, "sudo -E node"), ProcessFacts(2, "launcher"))
    monkeypatch.setattr(NodeApi, "address", lambda _name: "http://localhost:1/")
    monkeypatch.setattr(NodeApi, "ask_pid", lambda _uri: 1)
    monkeypatch.setattr(NodeApi, "request_shutdown", lambda name, _reason: asked.append(name) or True)
    monkeypatch.setattr(node_processes, "look_up", lambda _name: Answer(True, True, lineage, "http://localhost:1/"))
    nodes._ask_to_end("/a", process)
    assert asked == ["/a"]
