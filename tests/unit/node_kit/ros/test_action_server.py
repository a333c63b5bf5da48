"""An action server whose node ends while it publishes the status, or whose clock is set back."""

import threading

import pytest
import rospy
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
