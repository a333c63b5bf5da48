"""Messages of a topic to which rospy subscribed once for two listeners of this process, in the class of the first."""

import genpy
import pytest
import rospy
from rosgraph_monitor.ros.topics import packed, unpacked
from std_msgs.msg import Float32, String


@pytest.fixture
def anonymous():
    def make(message):
        found = rospy.AnyMsg()
        found._buff = packed(message)
        found._connection_header = {"type": message._type, "md5sum": message._md5sum}
        return found

    return make


def test_message_is_the_same_whoever_subscribed_first(anonymous):
    assert unpacked(Float32(0.5), Float32).data == 0.5
    assert unpacked(anonymous(Float32(0.5)), Float32).data == 0.5
    assert packed(Float32(0.5)) == packed(anonymous(Float32(0.5))) == b"\x00\x00\x00?"


def test_message_of_another_type_is_refused(anonymous):
    with pytest.raises(TypeError, match=r"it is a std_msgs/String, not a std_msgs/Float32"):
        unpacked(anonymous(String("a text")), Float32)


def test_broken_message_is_refused(anonymous):
    message = anonymous(Float32(0.5))
    message._buff = b"\x00"
    with pytest.raises(genpy.DeserializationError):
        unpacked(message, Float32)
