"""Goals of actions that are answered at once.

actionlib's SimpleActionClient learns the goal's handle only after the goal was sent. If the server is faster, for
example because it rejects the goal, the client drops the answer ("a goal handle that we're not tracking"), and waits in
vain.
"""

from __future__ import annotations

import threading
from typing import Any

import rospy

from node_kit.ros.patience import Patience

_DONE = 7  # actionlib.CommState.DONE
_LOOK_PERIOD = 0.05  # s, wall, between two looks at the ROS clock


def send_and_wait(client: Any, goal: Any, patience_s: float) -> Any:
    """Send a goal, and wait until it has ended; cancel it if that lasts too long.

    Args:
        client: an ActionClient of actionlib, whose server is connected. This package does not need actionlib itself.
        goal: of the action.
        patience_s: s of ROS time.

    Returns:
        The goal's handle, with `get_goal_status()` and `get_result()`; None if it has not ended in time.
    """
    ended = threading.Event()

    def look(handle: Any) -> None:
        if handle.get_comm_state() == _DONE:
            ended.set()

    handle = client.send_goal(goal, transition_cb=look)
    patience = Patience(patience_s)
    while not ended.wait(_LOOK_PERIOD):
        if rospy.is_shutdown() or patience.is_over():
            handle.cancel()
            return None
    return handle
