"""What the monitor tells of a node that dies while the master is asked."""

import threading
from types import SimpleNamespace

import pytest
import rospy
from ros_model.graph.snapshot import build_snapshot
from rosgraph_monitor.evaluation import GraphEvaluator, Patience
from rosgraph_monitor.graph.desired import Desired
from rosgraph_monitor.health.liveness import Life
from rosgraph_monitor.io.graph_poller import PolledGraph
from rosgraph_monitor.ros.monitor import MonitorNode

PUMP = "/pump", "http://shed:1/"
LISTED = build_snapshot([[["/flow", ["/pump"]]], [], []], [], {}, dict([PUMP]))


@pytest.fixture
def known():
    """Return what the connections know of the nodes."""
    return {PUMP: Life.ALIVE}


@pytest.fixture
def monitor(monkeypatch, known):
    """Return a monitor of a pump, without a master."""
    monkeypatch.setattr(rospy, "get_name", lambda: "/monitor")
    node = object.__new__(MonitorNode)
    node._events, node._polled = threading.Event(), threading.Event()
    node._connections = SimpleNamespace(lives=lambda: dict(known))
    node._poller = SimpleNamespace(latest=None, request=lambda: None)
    node._monitor, node._model = GraphEvaluator({"pump": "pump"}), SimpleNamespace(current=Desired(None))
    node._topics = SimpleNamespace(topics={}, judge=lambda *_: [])
    node._batteries = node._drivers = SimpleNamespace(conditions={}, reasons={})
    node._patience, node._grace, node._graph_problem, node._observers_due = Patience(), 0.0, "", float("inf")
    return node


def poll(monitor, lives):
    """A poll ends that began when so much was known."""
    monitor._poller.latest = PolledGraph(LISTED, lives, 0.3)
    monitor._on_poll()


def told(monitor):
    """What is told of the pump."""
    statuses = monitor._evaluate(monitor._poller.latest)
    return next(dict(status.values) for status in statuses if status.name == "pump")


def test_node_that_dies_during_a_poll_is_told_at_once_and_the_next_poll_says_how(monitor, known):
    poll(monitor, {PUMP: Life.ALIVE})
    assert told(monitor)["pump"] == "TRUE"
    known[PUMP] = Life.DEAD
    monitor._on_life()
    poll(monitor, {PUMP: Life.ALIVE})
    assert not monitor._polled.is_set()  # it waits for one that began afterwards, but not for long
    assert told(monitor)["pump"] == "FALSE"
    poll(monitor, {PUMP: Life.DEAD})
    assert monitor._polled.is_set()
    assert told(monitor)["pump"] == "FALSE"


def test_dead_node_is_not_told_as_well_by_a_poll_that_began_before(monitor, known):
    poll(monitor, {PUMP: Life.ALIVE})
    known[PUMP] = Life.DEAD
    monitor._on_life()
    assert told(monitor)["pump"] == "FALSE"
    poll(monitor, {PUMP: Life.ALIVE})
    assert told(monitor)["pump"] == "FALSE"


def test_node_that_is_back_is_told_without_another_poll(monitor, known):
    known[PUMP] = Life.HUNG
    poll(monitor, {PUMP: Life.HUNG})
    assert told(monitor)["pump"] == "FALSE"
    known[PUMP] = Life.ALIVE
    monitor._on_life()
    assert told(monitor)["pump"] == "RECOVERED"
