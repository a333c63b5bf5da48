"""The share of the parts on the tray that the detector finds."""

from __future__ import annotations

from typing import Any

import geometry_msgs.msg
import std_msgs.msg
from diagnostic_msgs.msg import DiagnosticStatus
from rosgraph_monitor.observer import TopicObserver

LOWEST = 0.0
"""Value of the formula that is level 0 of found."""
HIGHEST = 1.0
"""Value of the formula that is level 1 of found; higher is better."""


class FoundObserver(TopicObserver):
    """Publishes `found` at 5 Hz of ROS time. While a topic is silent, it is stale."""

    qa_name = "found"

    def __init__(self, name: str = "FoundObserver") -> None:
        super().__init__(name, 5.0, [("parts", geometry_msgs.msg.PoseArray), ("scale", std_msgs.msg.UInt32)])

    def calculate_attr(self, msgs: list[Any]) -> DiagnosticStatus:
        """Return the level of the share of parts that were found; an empty tray hides none."""
        parts, scale = msgs
        return self.status_of(len(parts.poses) / scale.data if scale.data else HIGHEST)

    def status_of(self, value: float) -> DiagnosticStatus:
        """Return the diagnostics of a value: its level, 0 at LOWEST and 1 at HIGHEST; values beyond are clipped."""
        return self.qa_status(min(max((value - LOWEST) / (HIGHEST - LOWEST), 0.0), 1.0))
