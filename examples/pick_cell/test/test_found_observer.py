"""Test of FoundObserver; it needs no ROS master."""

import sys
from pathlib import Path

import geometry_msgs.msg
import pytest
import std_msgs.msg

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "src"))  # the workspace may not be built yet
from pick_cell.found_observer import FoundObserver

FOUR_PARTS = geometry_msgs.msg.PoseArray(poses=[geometry_msgs.msg.Pose()] * 4)

# Messages in the order of the observer's topics, and the level of found, 0 to 1, that follows from them.
CASES = [
    ((geometry_msgs.msg.PoseArray(), std_msgs.msg.UInt32(5)), 0.0),
    ((FOUR_PARTS, std_msgs.msg.UInt32(5)), 0.8),
    ((geometry_msgs.msg.PoseArray(), std_msgs.msg.UInt32(0)), 1.0),
]


@pytest.mark.parametrize(("msgs", "level"), CASES)
def test_level_follows_from_the_messages(msgs, level):
    observer = FoundObserver()
    for (topic, _), msg in zip(observer.topics, msgs, strict=True):
        observer.receive(topic, msg, 0.0)
    (status,) = observer.evaluate(0.0)
    assert status.message == "QA status", status.values
    assert status.values[0].key == "found"
    assert float(status.values[0].value) == pytest.approx(level)


def test_silence_is_stale_and_never_fine():
    (status,) = FoundObserver().evaluate(0.0)
    assert status.message == "QA stale"
