"""Servers of actions: clients look for them in wall time, and they end without a traceback.

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


class EndsQuietly:
    """Goes before actionlib's ActionServer in a list of bases: such a server may end at any time.

    Its timer publishes the status now and then. Where that happens just when the node closes its topics, actionlib lets
    a traceback be printed. rospy closes them before `is_shutdown` says so, but after the end was asked for.
    """

    def publish_status(self) -> None:
        """Publish the status of all goals, unless the node is ending."""
        try:
            super().publish_status()  # type: ignore[misc]
        except rospy.ROSException:
            if not rospy.core.is_shutdown_requested():
                raise
