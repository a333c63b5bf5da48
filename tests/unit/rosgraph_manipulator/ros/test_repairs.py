"""Repairs and repaired drivers of which something can't be started just then."""

from types import SimpleNamespace

import pytest
from rosgraph_launcher.launching.report import STABLE, LauncherReport
from rosgraph_manipulator.change.deployment import DeploymentError
from rosgraph_manipulator.configuration.configurations import Configuration, ManipulatorOptions, Repair
from rosgraph_manipulator.ros import repairs
from rosgraph_manipulator.ros.repairs import RepairServer

GATE = Configuration("repair_of_gate", "repair_of_gate", "gate.launch")


class Executor:
    """A launcher that runs the gate's driver.

    Attributes:
        failures: by which the next starts fail.
        started: how often a driver was to be started.
    """

    def __init__(self):
        self.reported, self.failures, self.started, self.is_gone = STABLE, [], 0, False

    def report(self, function):
        return LauncherReport(function, GATE.name if self.reported else "", state=STABLE, nodes=("/gate",))

    def is_unconnected(self, _function):
        return self.is_gone

    def start_driver(self, _driver):
        self.started += 1
        if self.failures:
            raise self.failures.pop()
        self.reported = STABLE


@pytest.fixture
def executor():
    return Executor()


@pytest.fixture
def server(monkeypatch, executor):
    monkeypatch.setattr(repairs, "ActionServer", lambda *_, **__: None)
    monkeypatch.setattr(repairs, "time", SimpleNamespace(monotonic=lambda: server.now))
    options = ManipulatorOptions({}, repairs={"gate": Repair("gate", driver=GATE), "lamp": Repair("lamp", "lamp/on")})
    server = RepairServer(options, SimpleNamespace(put=lambda _work: None), executor, 1.0)
    server.now = 0.0
    return server


class Goal:
    def __init__(self, id_):
        self.told, self._id = [], id_

    def get_goal(self):
        return SimpleNamespace(component="lamp")

    def get_goal_id(self):
        return SimpleNamespace(id=self._id)

    def __getattr__(self, name):
        return lambda *arguments: self.told.append((name, *arguments[1:]))


def test_repair_without_a_thread_ends_and_can_be_asked_for_again(monkeypatch, no_thread, server):
    no_thread()
    server._on_goal(first := Goal("1"))
    assert first.told == [("set_accepted",), ("set_aborted", "no thread could be started: can't start new thread")]
    monkeypatch.setattr(repairs, "start_thread", lambda _work, _name: None)
    server._on_goal(second := Goal("2"))
    assert second.told == [("set_accepted",)]


def test_lost_driver_is_started_again_until_that_succeeds(server, executor):
    executor.reported = ""
    executor.failures = [DeploymentError("not now"), OSError("nor now")]
    for now, started in ((0.0, 1), (0.5, 1), (1.5, 2), (3.0, 3), (9.0, 3)):
        server.now = now
        server.look()
        assert executor.started == started
    executor.reported = ""
    server.now = 20.0
    server.follow_launcher()
    assert executor.started == 4


def test_lost_driver_waits_for_its_launcher(server, executor):
    executor.reported, executor.is_gone = "", True
    server.look()
    assert executor.started == 0
    executor.is_gone = False
    server.look()
    assert executor.started == 1
