"""How old the last message of the talker is, as a quality level: 0 is new, 1 is 10 s and more."""

from __future__ import annotations

from typing import Any

import rospy
import std_msgs.msg
from diagnostic_msgs.msg import DiagnosticStatus
from rosgraph_monitor.observer import TopicObserver

LOWEST = 0.0
"""s; level 0 of freshness."""
HIGHEST = 10.0
"""s; level 1 of freshness."""


class FreshnessObserver(TopicObserver):
    """Publishes `freshness` at 2 Hz."""

    qa_name = "freshness"
    max_age = 60.0  # s, until it is stale: silence is what it measures

    def __init__(self, name: str = "FreshnessObserver") -> None:
        super().__init__(name, 2.0, [("chatter", std_msgs.msg.Header)])

    def calculate_attr(self, msgs: list[Any]) -> DiagnosticStatus:
        """Return the level of the last message's age."""
        return self.status_of(rospy.get_time() - msgs[0].stamp.to_sec())

    def status_of(self, value: float) -> DiagnosticStatus:
        """Return the diagnostics of an age in s."""
        return self.qa_status(min(max((value - LOWEST) / (HIGHEST - LOWEST), 0.0), 1.0))
