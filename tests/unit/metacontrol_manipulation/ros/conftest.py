"""rospy without a master."""

from types import SimpleNamespace
from unittest.mock import Mock

import pytest
import rospy


@pytest.fixture
def clock(monkeypatch):
    """A ROS clock at 1000 s, which only goes on while somebody sleeps; no topics."""
    monkeypatch.setattr(rospy.rostime, "_rostime_initialized", True)
    monkeypatch.setattr(rospy, "is_shutdown", lambda: False)
    monkeypatch.setattr(rospy, "Publisher", Mock(side_effect=lambda *_, **__: Mock()))
    monkeypatch.setattr(rospy, "Subscriber", Mock())

    def set_to(seconds):
        monkeypatch.setattr(rospy.rostime, "_rostime_current", rospy.Time.from_sec(seconds))

    def sleep(seconds):
        set_to(rospy.get_time() + seconds)

    monkeypatch.setattr(rospy, "sleep", sleep)
    set_to(1000.0)
    return SimpleNamespace(set_to=set_to)
