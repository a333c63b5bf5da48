"""A decision becomes a message whatever its stamps are: they may be of before the clock was set back, or absurd."""

import io
import math

import pytest
import rospy
from metacontrol_bags.decision import DECIDED, Cause, Decision
from metacontrol_msgs import msg
from mros1_reasoner.ros.messages import fill_decision


@pytest.mark.parametrize(
    ("stamp", "secs"), [(1.5, 1), (-9.5, 0), (-math.inf, 0), (math.nan, 0), (2.0**32, 2**32 - 1), (1e300, 2**32 - 1)]
)
def test_stamps_fit_into_the_message(stamp, secs):
    decision = Decision("d-1", DECIDED, "o", "t", "a", "b", stamp_monitored=stamp, reasons=(Cause(stamp, "t", "x"),))
    message = fill_decision(msg.Decision(), decision, rospy.Time.from_sec, msg)
    message.serialize(io.BytesIO())
    assert (message.stamp_monitored.secs, message.reasons[0].stamp.secs) == (secs, secs)
