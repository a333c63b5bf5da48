"""The loop's time: ROS time that is never set back, so that no moment that the loop keeps lies in the future.

ROS time is set back where a simulation is reset, or a bag is played again.
"""

from __future__ import annotations

import math
from dataclasses import replace

from metacontrol_bags.decision import Decision

_LATEST = math.nextafter(2.0**32, 0.0)  # s
_TOLERANCE = 1.0  # s, by which messages may be older than one before them


class LoopTime:
    """Turns ROS time into the loop's, and back; both are in s, and the same until the clock is set back."""

    def __init__(self) -> None:
        """Begin before any time."""
        self._last, self._ahead = -math.inf, 0.0

    def take(self, now: float) -> float:
        """Return the loop's time at a present ROS time."""
        if now + self._ahead < self._last - _TOLERANCE:
            self._ahead = self._last - now
        self._last = max(self._last, now + self._ahead)
        return now + self._ahead

    def of(self, stamp: float) -> float:
        """Return the loop's time at a stamp, which may be of before the clock was set back; 0: there is none.

        A stamp that no message's time can hold, from 0 to less than 2**32 s, becomes the nearest one.
        """
        stamp = min(max(0.0, stamp), _LATEST)
        return min(stamp + self._ahead, self._last) if stamp and self._ahead else stamp

    def ros(self, moment: float) -> float:
        """Return the ROS time of a moment of the loop."""
        return moment - self._ahead

    def told(self, decision: Decision) -> Decision:
        """Return a decision with its stamps in ROS time."""
        if not self._ahead:
            return decision
        return replace(
            decision,
            reasons=tuple(replace(cause, stamp=self._ros_stamp(cause.stamp)) for cause in decision.reasons),
            stamp_monitored=self._ros_stamp(decision.stamp_monitored),
            stamp_analysed=self._ros_stamp(decision.stamp_analysed),
            stamp_planned=self._ros_stamp(decision.stamp_planned),
            stamp_executed=self._ros_stamp(decision.stamp_executed),
        )

    def _ros_stamp(self, stamp: float) -> float:
        return self.ros(stamp) if stamp else stamp
