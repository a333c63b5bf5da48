"""What a bag does not tell of a mission."""

import numpy as np
import pytest
from metacontrol_bags.bag import Salvaged
from metacontrol_bags.gaps import holes_in_words, nothing_of_a_mission
from metacontrol_bags.metrics import summarise
from metacontrol_bags.record import Event, MissionRecord


def mission(*stamps):
    """A mission from 100 to 104 s, with a pose at each stamp."""
    poses = np.array([(stamp, stamp, 0.0) for stamp in stamps]).reshape(-1, 3)
    return MissionRecord(
        events=(Event(100.0, "MISSION_START", "", {}), Event(104.0, "MISSION_END", "", {})), poses=poses
    )


def every(step, since, until):
    return np.arange(since, until, step)


@pytest.mark.parametrize(
    ("stamps", "expected"),
    [
        (every(0.05, 99.0, 104.5), []),
        (every(0.05, 100.98, 104.5), [[0.0, 0.98]]),
        ([*every(0.05, 99.0, 101.01), *every(0.05, 102.6, 103.21)], [[1.0, 2.6], [3.2, 4.0]]),
        ([], []),
    ],
    ids=["whole", "late recorder", "two holes", "no ground truth"],
)
def test_spans_without_a_pose_are_in_the_summary(stamps, expected):
    assert np.allclose(summarise(mission(*stamps))["unrecorded"], expected)


def test_holes_are_told_in_one_line():
    (line,) = holes_in_words(mission(*every(0.05, 100.98, 104.5)))
    assert "0.0 to 1.0 s of the mission" in line
    assert holes_in_words(mission(*every(0.05, 99.0, 104.5))) == ()


def test_topics_of_a_bag_without_a_mission_are_told_in_marks_that_can_be_printed():
    said = nothing_of_a_mission(Salvaged(mission(), frozenset({"/scan\x1b[2J"}), ()))
    assert "only /scan\\x1b[2J: record" in said
