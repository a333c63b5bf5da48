"""Drivers that take rays or images while somebody listens, whatever the order in which rospy tells of it."""

from types import SimpleNamespace

import pytest
import rospy
from pybullet_simulator.ros.camera import CameraNode
from pybullet_simulator.ros.laser import LaserNode

SOURCES = {"laser": "simulator/front_rays", "camera": "simulator/depth"}


class Listeners:
    """rospy without a network: who listens to the node, and which of its subscriptions are open."""

    def __init__(self):
        self.count = 0
        self.open = []

    def publisher(self, *_arguments, **_options):
        return SimpleNamespace(
            get_num_connections=lambda: self.count,
            impl=SimpleNamespace(has_connections=lambda: self.count > 0),
        )

    def subscriber(self, topic, *_arguments, **_options):
        self.open.append(topic)
        return SimpleNamespace(unregister=lambda: self.open.remove(topic))


@pytest.fixture
def listeners(monkeypatch):
    listeners = Listeners()
    monkeypatch.setattr(rospy, "Publisher", listeners.publisher)
    monkeypatch.setattr(rospy, "Subscriber", listeners.subscriber)
    monkeypatch.setattr(rospy, "get_param", lambda *_: {})
    monkeypatch.setattr(rospy, "get_name", lambda: "/sensor")
    return listeners


@pytest.fixture(params=SOURCES)
def driver(request, listeners):
    """Makes a driver; returns it, and a function that tells how many subscriptions to its source are open."""

    def make():
        node = LaserNode("front") if request.param == "laser" else CameraNode()
        return node, lambda: listeners.open.count(SOURCES[request.param])

    return make


def test_source_is_open_while_somebody_listens(driver, listeners):
    node, subscriptions = driver()
    assert subscriptions() == 0
    for count in (1, 2):
        listeners.count = count
        node.peer_subscribe("topic", None, None)
        assert subscriptions() == 1
    for count in (1, 0):
        listeners.count = count
        node.peer_unsubscribe("topic", count)
        assert subscriptions() == count


def test_end_of_one_listener_that_is_told_after_the_next_came_closes_nothing(driver, listeners):
    node, subscriptions = driver()
    listeners.count = 1
    node.peer_subscribe("topic", None, None)
    node.peer_subscribe("topic", None, None)  # the second, while the first is gone, but rospy has not told yet
    node.peer_unsubscribe("topic", 0)
    assert subscriptions() == 1


def test_listener_that_is_told_after_it_went_opens_nothing(driver, listeners):
    node, subscriptions = driver()
    node.peer_unsubscribe("topic", 0)
    node.peer_subscribe("topic", None, None)
    assert subscriptions() == 0


def test_listener_from_before_the_node_was_ready_is_served(driver, listeners):
    listeners.count = 1
    _, subscriptions = driver()
    assert subscriptions() == 1
