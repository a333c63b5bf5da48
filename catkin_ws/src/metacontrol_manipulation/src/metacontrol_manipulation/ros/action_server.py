"""The server of the actions of this package: one goal at a time, in a thread of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import actionlib
from actionlib.server_goal_handle import ServerGoalHandle
from node_kit.ros.action_server import Sturdy

if TYPE_CHECKING:
    from collections.abc import Callable


class _Server(Sturdy, actionlib.ActionServer):
    """actionlib's, which outlives a clock that is set back, and ends without a traceback."""


class SimpleServer(actionlib.SimpleActionServer):
    """actionlib's, on a server that outlives a clock that is set back.

    actionlib cancels a goal that has an earlier stamp than the last one. So after one goal with a stamp from the
    future, or from before the clock was set back, it would cancel each new goal.
    """

    def __init__(self, name: str, action: Any, execute: Callable[[Any], None], auto_start: bool = True) -> None:
        """Prepare the server, or start it (see actionlib)."""
        super().__init__(name, action, execute, auto_start=False)
        self.action_server = _Server(
            name, action, self.internal_goal_callback, self.internal_preempt_callback, auto_start=False
        )
        if auto_start:
            self.start()

    def internal_goal_callback(self, goal: ServerGoalHandle) -> None:
        """Take a goal (called by actionlib), whatever the stamp of one that has ended."""
        with self.lock:
            if not (self.new_goal or self.is_active()):
                self.current_goal = self.next_goal = ServerGoalHandle()
        super().internal_goal_callback(goal)
