"""A line of a log asks the master for nothing, so that a late one registers nobody."""

from types import SimpleNamespace

import pytest
import rospy
from node_kit.ros.rosout_parameter import PARAMETER, read_rosout_parameter
from rosgraph_msgs.msg import Log
from rospy.impl import rosout


@pytest.fixture
def master(monkeypatch):
    """Tell how the parameter is read, and what is subscribed to."""
    played = SimpleNamespace(value=False, subscribed=[])

    def get_param(name, default):
        assert name == PARAMETER
        if isinstance(played.value, Exception):
            raise played.value
        return default if played.value is None else played.value

    def get_param_cached(name, default=None):
        played.subscribed.append(name)
        return default

    monkeypatch.setattr(rospy, "get_param", get_param)
    monkeypatch.setattr(rospy, "get_param_cached", get_param_cached)
    monkeypatch.setattr(rosout, "rospy", rospy)  # restores it in the end
    return played


@pytest.fixture
def lines(monkeypatch):
    published = []
    monkeypatch.setattr(rosout, "_rosout_pub", SimpleNamespace(publish=published.append))
    monkeypatch.setattr(rosout, "Time", SimpleNamespace(now=lambda: rospy.Time(1)))
    monkeypatch.setattr(rosout, "get_topic_manager", lambda: SimpleNamespace(get_topics=lambda: ["/scan"]))
    return published


@pytest.mark.parametrize(
    ("value", "topics"), [(None, ["/scan"]), (False, ["/scan"]), (True, ""), (ConnectionRefusedError(), ["/scan"])]
)
def test_line_has_the_topics_as_the_parameter_was_at_the_start(master, lines, value, topics):
    master.value = value
    read_rosout_parameter()
    master.value = not value
    rosout._rosout(Log.WARN, "hello", "file", 1, "function")
    assert [(line.msg, line.topics) for line in lines] == [("hello", topics)]
    assert master.subscribed == []


def test_other_parameters_are_cached_as_ever(master):
    read_rosout_parameter()
    rosout.rospy.get_param_cached("/other", 1)
    assert master.subscribed == ["/other"]
