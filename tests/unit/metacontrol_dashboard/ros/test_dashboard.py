"""The node looks at the graph again and again, whatever one look finds."""

import threading
from types import SimpleNamespace as Thing

import pytest
from metacontrol_dashboard.ros import dashboard
from metacontrol_dashboard.ros.dashboard import DashboardNode
from nav_msgs.msg import OccupancyGrid

DEADLINE_S = 30


def snapshot(kind):
    return Thing(topics={"/map": Thing(name="/map", type=kind, publishers=("/a",))}, nodes={}, parameters={})


class Looking(DashboardNode):
    """A node without ROS that looks until the test has seen enough."""

    def __init__(self, look):
        self.looks, self._look_at = 0, look
        self._client = Thing(snapshot=lambda: None)

    def _look(self, _snapshot):
        self.looks += 1
        self._look_at(self.looks)

    def _tell_earlier_decisions(self):
        return


@pytest.fixture
def logged(monkeypatch):
    said = []
    monkeypatch.setattr(dashboard, "_PERIOD", 0.0)
    monkeypatch.setattr(dashboard.rospy, "logerr_throttle", lambda _, text, *values: said.append(text % values))
    return said


def run_until(node, is_over, monkeypatch):
    monkeypatch.setattr(dashboard.rospy, "is_shutdown", lambda: is_over(node))
    node.run()


def test_look_that_fails_is_told_and_the_next_one_is_made(logged, monkeypatch):
    def fail_once(looks):
        if looks == 1:
            raise ValueError("invalid\nname")

    run_until(Looking(fail_once), lambda node: node.looks >= 2, monkeypatch)
    assert logged == ["a look at the graph has failed: ValueError: invalid name"]


def test_reasoner_that_hangs_keeps_nobody_from_looking(logged, monkeypatch):
    released = threading.Event()
    node = Looking(lambda _: None)
    node._tell_earlier_decisions = released.wait
    try:
        run_until(node, lambda node: node.looks >= 2, monkeypatch)
        assert not released.is_set()
    finally:
        released.set()


@pytest.mark.parametrize("kind", ["nav_msgs/OccupancyGrid", "nav_msgs/msg/OccupancyGrid"])
def test_map_is_heard_by_either_name_of_its_type(kind, monkeypatch):
    node = Looking(lambda _: None)
    node._robot, node._places, node._server = "/", {}, Thing(viewers=0)
    heard = []
    monkeypatch.setattr(dashboard.rospy, "Subscriber", lambda topic, _, take, **__: heard.append((topic, take)))
    node._follow_places(snapshot(kind))
    [(topic, take)] = heard
    assert (topic, take.__self__._kind) == ("/map", OccupancyGrid)
