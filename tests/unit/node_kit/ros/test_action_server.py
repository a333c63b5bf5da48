"""An action server whose node ends while it publishes the status, whose clock is set back, or who gets odd cancels."""

import gc
import threading
from unittest.mock import Mock

import actionlib
import pytest
import rospy
from actionlib import msg
from actionlib_msgs.msg import GoalID, GoalStatus
from helpers.waiting import wait_for
from node_kit.ros.action_server import Sturdy


class Closed:
    """What actionlib's server does when the topic is closed."""

    def publish_status(self):
        raise rospy.ROSException("publish() to a closed topic")


class Server(Sturdy, Closed):
    pass


def test_closed_topic_is_no_traceback_at_the_end(monkeypatch):
    monkeypatch.setattr(rospy.core, "is_shutdown_requested", lambda: True)  # is_shutdown() is not true yet
    Server().publish_status()


def test_closed_topic_is_told_while_the_node_runs(monkeypatch):
    monkeypatch.setattr(rospy.core, "is_shutdown_requested", lambda: False)
    with pytest.raises(rospy.ROSException, match="closed topic"):
        Server().publish_status()


class Timed(Sturdy):
    """As actionlib's server begins."""

    def __init__(self):
        self.published = threading.Event()


class Actionlib:
    def initialize(self):
        self.status_timer = rospy.Timer(rospy.Duration(0.2), self.publish_status_async)

    def publish_status_async(self, _event):
        self.published.set()


class Steady(Timed, Actionlib):
    pass


def set_clock(seconds):
    rospy.rostime._set_rostime(rospy.Time.from_sec(seconds))


def test_status_goes_on_when_the_clock_is_set_back(monkeypatch):
    monkeypatch.setattr(rospy.rostime, "_rostime_initialized", True)
    monkeypatch.setattr(rospy.rostime, "_rostime_current", rospy.Time(100))
    server = Steady()
    server.initialize()

    def is_published_at(*times):
        server.published.clear()
        for seconds in times:
            set_clock(seconds)
            if server.published.wait(0.1):
                return True
        return False

    try:
        wait_for(lambda: is_published_at(100.5, 101.0), "the status")
        set_clock(40.0)
        wait_for(lambda: is_published_at(41.0, 42.0, 43.0, 44.0, 45.0), "the status after 40 s")
    finally:
        server.status_timer.shutdown()
        set_clock(1000.0)


class Cancelling(Sturdy, actionlib.ActionServer):
    """actionlib's server without topics; every goal is accepted."""

    def __init__(self):
        super().__init__("test", msg.TestAction, lambda handle: handle.set_accepted(), auto_start=False)
        self.started = True
        self.status_pub, self.result_pub = Mock(), Mock()

    def take(self, name, stamp):
        """Takes a goal and returns its status."""
        self.internal_goal_callback(msg.TestActionGoal(goal_id=GoalID(id=name, stamp=rospy.Time.from_sec(stamp))))
        return self.status_of(name)

    def cancel(self, name="", stamp=0.0):
        message = GoalID(id=name, stamp=rospy.Time.from_sec(stamp))
        self.internal_cancel_callback(message)
        assert message == GoalID(id=name, stamp=rospy.Time.from_sec(stamp))

    def status_of(self, name):
        return next(one.status.status for one in self.status_list if one.status.goal_id.id == name)


@pytest.fixture
def server(monkeypatch):
    """A server at 100 s."""
    monkeypatch.setattr(rospy.rostime, "_rostime_initialized", True)
    monkeypatch.setattr(rospy.rostime, "_rostime_current", rospy.Time(100))
    server = Cancelling()
    yield server
    server.status_list.clear()
    gc.collect()  # the end of a goal's handle asks for the time
    set_clock(1000.0)


ACTIVE, ENDING, CANCELLED = GoalStatus.ACTIVE, GoalStatus.PREEMPTING, GoalStatus.RECALLED


def test_cancel_from_the_future_ends_no_goal_but_the_one_it_names(server):
    assert [server.take("a", 99.0), server.take("b", 99.5)] == [ACTIVE, ACTIVE]
    server.cancel("a", 1e9)
    assert [server.status_of("a"), server.status_of("b"), server.take("c", 100.0)] == [ENDING, ACTIVE, ACTIVE]


def test_cancel_from_the_future_without_a_name_is_ignored_with_a_warning(server, caplog):
    assert server.take("a", 99.0) == ACTIVE
    server.cancel(stamp=1e9)
    assert [server.status_of("a"), server.take("b", 100.0)] == [ACTIVE, ACTIVE]
    assert "its stamp (1e+09 s) is in the future" in caplog.text


def test_cancel_from_the_future_holds_for_a_named_goal_that_comes_later(server):
    server.cancel("a", 1e9)
    assert [server.take("a", 99.0), server.take("b", 99.0)] == [CANCELLED, ACTIVE]


@pytest.mark.parametrize("stamp", [99.5, 100.5])  # the client's clock may be ahead a little
def test_cancel_with_a_stamp_ends_all_goals_up_to_then(server, stamp):
    server.take("a", 99.0)
    server.cancel(stamp=stamp)
    assert [server.status_of("a"), server.take("late", 99.2), server.take("new", 100.6)] == [ENDING, CANCELLED, ACTIVE]


def test_cancel_without_a_stamp_ends_all_goals_that_there_are(server):
    server.take("a", 99.0)
    server.cancel()
    assert [server.status_of("a"), server.take("b", 99.0)] == [ENDING, ACTIVE]


def test_cancel_from_before_the_clock_was_set_back_ends_no_new_goal(server):
    server.cancel(stamp=100.0)
    set_clock(40.0)
    assert server.take("a", 40.0) == ACTIVE
    set_clock(41.0)
    assert server.take("b", 40.5) == ACTIVE
