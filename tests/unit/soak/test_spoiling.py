"""Wrong data of messages of any type."""

import math
import random

import pytest
from actionlib_msgs.msg import GoalID
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState, LaserScan
from soak.spoiling import WRONG_FRAME, can_spoil, example, spoiled
from std_srvs.srv import TriggerRequest

SCAN = LaserScan(ranges=[1.0, 2.0, 3.0, 4.0], angle_min=-1.0)
SCAN.header.stamp.secs, SCAN.header.frame_id = 2000, "laser"


def wrong(how, message=SCAN):
    return spoiled(message, how, random.Random(1))


def test_numbers_are_spoiled_at_every_place():
    assert all(map(math.isnan, wrong("nan").ranges)) and math.isnan(wrong("nan").angle_min)
    assert all(map(math.isinf, wrong("infinite").ranges))
    assert math.isnan(wrong("nan", Odometry()).pose.pose.position.x)
    assert all(map(math.isnan, wrong("nan", Odometry()).pose.covariance))


@pytest.mark.parametrize(("how", "stamp"), [("future", 3000), ("past", 1000), ("repeat", 2000)])
def test_stamps_are_shifted(how, stamp):
    assert wrong(how).header.stamp.secs == stamp


def test_frame_and_sizes():
    assert wrong("wrong frame").header.frame_id == WRONG_FRAME
    assert len(wrong("wrong size").ranges) == 2 and len(wrong("empty").ranges) == 0


def test_message_itself_stays_right():
    wrong("nan")
    assert SCAN.ranges == [1.0, 2.0, 3.0, 4.0]


@pytest.mark.parametrize("kind", [DiagnosticArray, JointState, LaserScan, Odometry])
@pytest.mark.parametrize("how", ["nan", "infinite", "wrong frame", "wrong size", "empty", "future", "past", "repeat"])
def test_what_is_wrong_can_be_sent(kind, how):
    from io import BytesIO

    buffer = BytesIO()
    spoiled(example(kind), how, random.Random(1)).serialize(buffer)
    assert buffer.getvalue()


def test_example_has_an_element_in_each_list():
    assert len(example(DiagnosticArray).status) == 1 and len(example(JointState).position) == 1


@pytest.mark.parametrize(
    ("kind", "how", "can"),
    [
        (LaserScan, "nan", True),
        (GoalID, "nan", False),
        (GoalID, "future", True),
        (GoalID, "empty", True),
        (GoalID, "wrong frame", False),
        (TriggerRequest, "empty", False),
        (TriggerRequest, "repeat", True),
    ],
)
def test_only_what_has_the_fields_can_be_wrong_in_a_way(kind, how, can):
    assert can_spoil(kind, how) == can
