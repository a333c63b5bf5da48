"""Names of frames that tf2 does not take, and stamps after which it takes no others."""

import pytest
import rospy
from bad_input.unconnected import unconnected
from geometry_msgs.msg import TransformStamped
from move_base.ros import frames
from tf2_msgs.msg import TFMessage


@pytest.fixture
def transformer(monkeypatch):
    monkeypatch.setattr(frames, "_Listener", lambda _: None)
    transformer = frames.TfTransformer()
    known = TransformStamped()
    known.header.frame_id, known.child_frame_id = "map", "base_link"
    known.transform.rotation.w = 1.0
    transformer.buffer.set_transform_static(known, "test")
    return transformer


def test_known_frame_is_found(transformer):
    assert transformer.lookup("map", "base_link", None) is not None
    assert transformer.newest("map", "base_link") is not None


@pytest.mark.parametrize("name", ["attic", "", "/map", "a\0b", "\udc80"])
def test_odd_name_is_an_unknown_frame(transformer, name):
    for frame_names in (("map", name), (name, "map")):
        assert transformer.lookup(*frame_names, None) is None
        assert transformer.lookup(*frame_names, 5.0) is None
        assert transformer.newest(*frame_names) is None


@pytest.fixture
def hear():
    """Return what takes a transform of a stamp at a time, s, and tells up to which time the frame is known then."""
    with unconnected() as ros:
        transformer = frames.TfTransformer()
        (subscriber,) = ros.listening("/tf")

        def hear(now, stamp):
            rospy.rostime._set_rostime(rospy.Time.from_sec(now))
            transform = TransformStamped(child_frame_id="base_link")
            transform.header.frame_id, transform.header.stamp = "odom", rospy.Time.from_sec(stamp)
            transform.transform.rotation.w = 1.0
            message = TFMessage([transform])
            message._connection_header = {"callerid": "/localizer"}
            subscriber.give(message)
            return transformer.newest("odom", "base_link")

        yield hear


def test_transform_from_the_future_does_not_shut_out_those_of_the_present(hear):
    assert hear(50.0, 50.0) == 50.0
    assert hear(50.1, 1050.0) == 50.0
    assert hear(50.2, 50.2) == 50.2


@pytest.mark.parametrize("ahead", [-5.0, 0.0, 1.0, 9.5])
def test_transform_that_is_dated_ahead_a_little_is_taken(hear, ahead):
    assert hear(50.0, 50.0 + ahead) == 50.0 + ahead


def test_first_transform_is_taken_before_simulated_time_begins(hear):
    assert hear(0.0, 50.0) == 50.0


def test_stamp_that_tf2_can_not_hold_is_none(hear):
    assert hear(0.0, 2.0**31) is None
