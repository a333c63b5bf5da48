"""Looks for an action's server in wall time.

`wait_for_server` of actionlib waits in ROS time. Under simulated time, ROS time is 0 until the first /clock, and jumps
when that comes: a wait that began before ends at once, however long it was meant to be. While no clock runs, the wait
has no end.
"""

from __future__ import annotations

import time
from typing import Any

import rospy

_LOOK_PERIOD = 0.01  # s, wall, as in actionlib


class _OneLook(rospy.Duration):
    """A timeout of 0 that actionlib does not take for "no limit": it looks once, whatever the clock says."""

    __slots__ = ()

    def __ne__(self, _other: object) -> bool:
        return True


def is_connected(client: Any) -> bool:
    """Tell, without waiting, whether a client (ActionClient, SimpleActionClient) is connected to its action's server.

    Args:
        client: a client of actionlib, which this package does not need itself.
    """
    return bool(client.wait_for_server(_OneLook()))


def wait_for_server(client: Any, patience_s: float) -> bool:
    """Wait until a client is connected to its action's server; return whether it is.

    Args:
        client: a client of actionlib.
        patience_s: how long to wait, s, wall.
    """
    deadline = time.monotonic() + patience_s
    while not is_connected(client):
        if time.monotonic() >= deadline or rospy.is_shutdown():
            return False
        time.sleep(_LOOK_PERIOD)
    return True
