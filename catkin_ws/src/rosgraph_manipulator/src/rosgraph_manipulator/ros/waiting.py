"""Waits for what another thread or process brings about."""

from __future__ import annotations

import time
from collections.abc import Callable

import rospy

POLL_PERIOD = 0.01  # s, wall


def wait_until(condition: Callable[[], bool], timeout: float) -> bool:
    """Wait for a condition; return whether it became true within `timeout` (s, wall)."""
    deadline = time.monotonic() + timeout
    while not condition():
        if time.monotonic() > deadline or rospy.is_shutdown():
            return False
        time.sleep(POLL_PERIOD)
    return True
