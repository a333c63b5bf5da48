"""Processes that stand by for Python nodes, with real processes."""

import os
import signal

import pytest
from helpers.waiting import wait_for
from rosgraph_launcher.io import processes
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


def test_processes_that_stand_by_are_started_one_by_one(nodes, prepared, begun):
    assert not nodes.stand_by(begun, may_start=False)
    assert [nodes.stand_by(begun, may_start=True) for _ in range(3)] == [True, True, False]
    assert len(prepared) == 2
    nodes.stand_by(begun[:1], may_start=False)
    assert prepared[0].status is None
    assert prepared[1].status is not None


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
