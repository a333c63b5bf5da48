"""Servers of actions: clients look for them in wall time; they outlive a clock that is set back, and end quietly.

`wait_for_server` of actionlib waits in ROS time. Under simulated time, ROS time is 0 until the first /clock, and jumps
when that comes: a wait that began before ends at once, however long it was meant to be. While no clock runs, the wait
has no end.
"""

from __future__ import annotations

import time
from typing import Any

import rospy

_LOOK_PERIOD = 0.01  # s, wall, as in actionlib
_MOST_AHEAD = 1.0  # s, how far the clock of a client's host may be ahead


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


class Sturdy:
    """Goes before actionlib's ActionServer in a list of bases: neither a jump of the clock nor its end disturbs it.

    Its timer publishes the status now and then. A timer of rospy ends for good where simulated time goes back, be it by
    one wrong message on /clock: clients would see their goals LOST. Where the timer fires just when the node closes its
    topics, actionlib lets a traceback be printed. rospy closes them before `is_shutdown` says so, but after the end was
    asked for.

    A request to cancel with a stamp cancels all goals up to then, even those that come later. So one stamp from the
    future, or from before the clock was set back, would end each new goal at once, for ever.
    """

    lock: Any  # as actionlib has them
    last_cancel: rospy.Time

    def initialize(self) -> None:
        """Begin, with a timer that goes on where time goes back."""
        super().initialize()  # type: ignore[misc]
        timer = getattr(self, "status_timer", None)  # there is none where the frequency is set to 0
        if timer is not None:
            timer.shutdown()
            self.status_timer = rospy.Timer(timer._period, self.publish_status_async, reset=True)  # type: ignore[attr-defined]

    def internal_cancel_callback(self, goal_id: Any) -> None:
        """Cancel goals (called by rospy), as far as `heeded` says."""
        heeded_id = heeded(goal_id)
        if heeded_id is None:
            rospy.logwarn_throttle(
                10.0, f"a request to cancel is ignored: its stamp ({goal_id.stamp.to_sec():g} s) is in the future"
            )
            return
        super().internal_cancel_callback(heeded_id)  # type: ignore[misc]

    def internal_goal_callback(self, goal: Any) -> None:
        """Take a goal (called by rospy), whatever was cancelled before the clock was set back."""
        with self.lock:
            if _is_ahead(self.last_cancel):
                self.last_cancel = rospy.Time()
            super().internal_goal_callback(goal)  # type: ignore[misc]

    def publish_status(self) -> None:
        """Publish the status of all goals, unless the node is ending."""
        try:
            super().publish_status()  # type: ignore[misc]
        except rospy.ROSException:
            if not rospy.core.is_shutdown_requested():
                raise


def heeded(goal_id: Any) -> Any | None:
    """Return what a `Sturdy` server heeds of a request to cancel: without a stamp from the future; None: nothing.

    Args:
        goal_id: an actionlib_msgs/GoalID.
    """
    if not _is_ahead(goal_id.stamp):
        return goal_id
    return type(goal_id)(id=goal_id.id) if goal_id.id else None  # a new one: other listeners get the same message


def _is_ahead(stamp: rospy.Time) -> bool:
    """Tell whether a stamp lies in the future, and the clocks of two hosts don't explain it."""
    return bool(stamp.to_sec() > rospy.get_time() + _MOST_AHEAD)
