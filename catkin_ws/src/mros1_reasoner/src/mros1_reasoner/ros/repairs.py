"""Sends the node reasoner's requests for repairs to the manipulator, several at once, and reports what fails."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import actionlib
import rospy
from actionlib_msgs.msg import GoalStatus
from metacontrol_msgs import msg as messages

_ACTION = "rosgraph_manipulator/repair"
_SERVER_WAIT = 1.0  # s, wall, at most, for the connections to the manipulator
_SERVER_LOOK = 0.02  # s, wall, between two looks whether they are there
ACKNOWLEDGE_WAIT = 2.0
"""Wall s until a request must be acknowledged: else its manipulator has died with it. The loop waits longer than that
for the component to work, so it does not take a repair for tried of which nobody knows."""
_ONE_LOOK = rospy.Duration(0, -1)
_TRIED = frozenset({GoalStatus.SUCCEEDED, GoalStatus.ABORTED})
"""How a repair ends that was tried. Others were refused or cancelled, or were lost with their manipulator."""


@dataclass
class _Request:
    decision: str
    component: str
    ends: float  # wall time by which the manipulator must be there
    handle: Any = None  # None: it could not be sent yet
    unheard: float = math.inf  # wall time by which it must be acknowledged; infinite where it is, or was not sent


class RepairRequests:
    """Asks the manipulator for repairs. Only callbacks of actionlib run outside the loop's thread."""

    def __init__(self, queue: Callable[[Callable[[], object]], object], report: Callable[..., None]) -> None:
        """Look for the manipulator from now on.

        Args:
            queue: has the loop's thread do something.
            report: is called in the loop's thread when a request has ended, with its decision, whether it was carried
                out, why not, and `blame`: whether the repair was tried.
        """
        self._client = actionlib.ActionClient(_ACTION, messages.RepairAction)
        self._queue, self._report = queue, report
        self._requests: dict[str, _Request] = {}

    def ask(self, decision: str, component: str) -> None:
        """Ask for a repair of a component; call `report` when the manipulator has done it, or has failed."""
        self._requests[decision] = _Request(decision, component, time.monotonic() + _SERVER_WAIT)
        self.look()

    def give_up(self, decision: str) -> None:
        """Ask no longer for the repair of a decision."""
        request = self._requests.pop(decision, None)
        if request and request.handle is not None:
            request.handle.cancel()

    def look(self) -> None:
        """Send the requests that could not be sent before; give up those that no manipulator has heard."""
        for request in list(self._requests.values()):
            if request.handle is None:
                self._send(request)
            elif request.handle.get_comm_state() != actionlib.CommState.WAITING_FOR_GOAL_ACK:
                request.unheard = math.inf
            elif time.monotonic() >= request.unheard:
                request.handle.cancel()
                silence = f"the manipulator has said nothing of it in {ACKNOWLEDGE_WAIT:g} s"
                self._end(request, False, silence, blame=False)

    def _send(self, request: _Request) -> None:
        if not rospy.get_rostime().is_zero() and self._client.wait_for_server(_ONE_LOOK):
            goal = messages.RepairGoal(request.component)
            request.unheard = time.monotonic() + ACKNOWLEDGE_WAIT
            request.handle = self._client.send_goal(goal, lambda handle: self._on_change(request, handle))
        elif time.monotonic() >= request.ends:
            name = rospy.resolve_name(_ACTION)
            self._end(request, False, f"the manipulator's action server {name} is not there", blame=False)

    @property
    def next_look(self) -> float:
        """The wall time of the next `look`."""
        if any(request.handle is None for request in self._requests.values()):
            return time.monotonic() + _SERVER_LOOK
        return min((request.unheard for request in self._requests.values()), default=math.inf)

    def _on_change(self, request: _Request, handle: Any) -> None:
        if handle.get_comm_state() != actionlib.CommState.DONE:
            return
        text, result = handle.get_goal_status_text(), handle.get_result()
        ok, message = (result.ok, result.message) if result is not None else (False, "")
        reason = message or text or "the manipulator gave no result"
        was_tried = result is not None and handle.get_goal_status() in _TRIED
        self._queue(lambda: self._end(request, ok, "" if ok else reason, blame=was_tried))

    def _end(self, request: _Request, ok: bool, message: str, *, blame: bool = True) -> None:
        if self._requests.pop(request.decision, None) is not None:  # else it was given up
            self._report(request.decision, ok, message, blame=blame)
