"""Waits in ROS time that end, also where the clock begins or is set back meanwhile."""

from __future__ import annotations

import rospy


class Patience:
    """An amount of ROS time, from now on.

    It begins anew where the clock is set back, and with a simulation's clock, which is 0 until its first message.
    """

    def __init__(self, duration: float) -> None:
        """Begin.

        Args:
            duration: s.
        """
        self._duration = duration
        self._since = rospy.get_time()

    def is_over(self) -> bool:
        """Tell whether the time has passed."""
        now = rospy.get_time()
        if self._since <= 0.0 or now < self._since:
            self._since = now
        return bool(now - self._since > self._duration)
