"""A goal's end is heard however early it comes, and a goal that does not end is cancelled."""

import threading
from types import SimpleNamespace

import pytest
import rospy
from actionlib import CommState, GoalStatus
from node_kit.ros.goals import send_and_wait


class Handle:
    def __init__(self):
        self.state, self.cancelled = CommState.ACTIVE, False

    def get_comm_state(self):
        return self.state

    def get_goal_status(self):
        return GoalStatus.REJECTED

    def cancel(self):
        self.cancelled = True


class Server:
    """A client whose server answers while the goal is being sent, later, or never."""

    def __init__(self, after=None):
        self.after, self.handle = after, Handle()

    def send_goal(self, goal, transition_cb):
        transition_cb(self.handle)  # it becomes active

        def end():
            self.handle.state = CommState.DONE
            transition_cb(self.handle)

        if self.after == 0.0:
            end()
        elif self.after is not None:
            threading.Timer(self.after, end).start()
        return self.handle


@pytest.fixture
def clock(monkeypatch):
    """Return a ROS clock that advances by 1 s with each look."""
    clock = SimpleNamespace(now=0.0)

    def look():
        clock.now += 1.0
        return clock.now

    monkeypatch.setattr(rospy, "get_time", look)
    monkeypatch.setattr(rospy, "is_shutdown", lambda: False)
    return clock


@pytest.mark.parametrize("after", [0.0, 0.1])
def test_end_is_heard_at_once_and_later(clock, after):
    server = Server(after)
    ended = send_and_wait(server, "goal", 1e6)
    assert ended is server.handle
    assert ended.get_goal_status() == GoalStatus.REJECTED
    assert not ended.cancelled


def test_goal_that_does_not_end_is_cancelled(clock):
    server = Server()
    assert send_and_wait(server, "goal", 5.0) is None
    assert server.handle.cancelled
    assert clock.now >= 6.0


def test_goal_that_does_not_end_is_cancelled_also_where_the_clock_is_set_back(monkeypatch):
    clock = iter([1e9, *map(float, range(20))])
    monkeypatch.setattr(rospy, "get_time", lambda: next(clock))
    monkeypatch.setattr(rospy, "is_shutdown", lambda: False)
    server = Server()
    assert send_and_wait(server, "goal", 5.0) is None
    assert server.handle.cancelled


def test_node_that_ends_waits_no_longer(clock, monkeypatch):
    monkeypatch.setattr(rospy, "is_shutdown", lambda: True)
    server = Server()
    assert send_and_wait(server, "goal", 1e6) is None
    assert server.handle.cancelled
