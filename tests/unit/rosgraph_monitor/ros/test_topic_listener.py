"""Topics as the monitor hears them."""

import zlib
from types import SimpleNamespace

import pytest
import rospy
from rosgraph_monitor.health.topics import TopicSpec
from rosgraph_monitor.ros import topics as module
from rosgraph_monitor.ros.topics import TopicListener


@pytest.mark.parametrize(("simulated", "said"), [(False, ""), (True, "Silent topic")])
def test_system_clock_that_is_set_makes_no_topic_silent(monkeypatch, simulated, said):
    ros, wall = [1.7e9], [100.0]
    monkeypatch.setattr(rospy, "Subscriber", lambda *_, **__: None)
    monkeypatch.setattr(rospy, "get_time", lambda: ros[0])
    monkeypatch.setattr(rospy.rostime, "is_wallclock", lambda: not simulated)
    monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: wall[0]))
    listener = TopicListener(5.0)
    listener.follow({"scan": TopicSpec("scan", max_age=1.0)})
    listener._receive(None, "scan")
    for _ in range(20):  # the clock is set by a little again and again; a simulation is that fast
        ros[0], wall[0] = ros[0] + 0.1, wall[0] + 0.03
    assert [verdict.message for verdict in listener.judge()] == [said]


def test_message_of_a_type_that_none_can_have_counts_as_a_whole():
    message = rospy.AnyMsg()
    message._buff, message._connection_header = b"abc", {"type": "std_msgs/msg/String"}
    assert TopicListener(5.0)._digest(message) == zlib.crc32(b"abc")
