"""Reports from ROS messages."""

from types import SimpleNamespace

import pytest
from metacontrol_bags import messages


def test_goal_counts_by_its_own_stamp_even_if_the_recorder_lags():
    sent = SimpleNamespace(
        header=SimpleNamespace(stamp=SimpleNamespace(sec=2, nanosec=500_000_000)), goal_id=SimpleNamespace(id="a")
    )
    assert messages.goal(sent, received=2.3).stamp == pytest.approx(2.5)
