"""A wait in ROS time ends, whatever the clock does."""

import pytest
import rospy
from node_kit.ros.patience import Patience


@pytest.mark.parametrize(
    "times",
    [
        (1000.0, 1005.0, 1010.0, 1010.1),
        (1000.0, 3.0, 13.0, 13.1),
        (1000.0, 1009.0, 990.0, 1000.1),
        (0.0, 0.0, 56.0, 66.1),
    ],
)
def test_patience_is_over_after_its_time_also_where_the_clock_is_set_back(monkeypatch, times):
    clock = iter(times)
    monkeypatch.setattr(rospy, "get_time", lambda: next(clock))
    patience = Patience(10.0)
    looks = [patience.is_over() for _ in times[1:]]
    assert looks == [False] * (len(looks) - 1) + [True]
