"""Sends the node reasoner's requests to the manipulator, one at a time, and reports failures."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import actionlib
import rospy
from actionlib_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from metacontrol_msgs import msg as messages

_SERVER_WAIT = 1.0  # s, wall, at most, for the connections to the manipulator: after a start they may be on their way
_SERVER_LOOK = 0.02  # s, wall, between two looks whether they are there
_ONE_LOOK = rospy.Duration(0, -1)
_MEANINGS = {0: "the manipulator restored the former one", -1: "the manipulator does not know it"}


@dataclass
class _Request:
    decision: str
    configuration: str
    ends: float  # wall time
    handle: Any = None  # None: it could not be sent yet


class Requests:
    """Asks the manipulator for configurations. Only callbacks of actionlib run outside the loop's thread."""

    def __init__(
        self, action: str, deadline: float, queue: Callable[[Callable[[], object]], object], report: Callable[..., None]
    ) -> None:
        """Look for the manipulator from now on.

        Args:
            action: its name.
            deadline: a request without a result has failed after so long, s of wall time.
            queue: has the loop's thread do something.
            report: is called in the loop's thread when a request has ended, with its decision, whether it was carried
                out, why not, and `blame`: whether that is the configuration's fault.
        """
        self._client = actionlib.ActionClient(action, messages.MvpReconfigurationAction)
        self._deadline, self._queue, self._report = deadline, queue, report
        self._diagnostics = rospy.Publisher("/diagnostics", DiagnosticArray, queue_size=10)
        self._request: _Request | None = None
        self._failures, self._trouble = 0, ""

    def ask(self, decision: str, configuration: str) -> None:
        """Ask for a configuration; call `report` when it runs, has failed, or nobody has answered in time."""
        self._request = _Request(decision, configuration, time.monotonic() + _SERVER_WAIT)
        self.look()

    def look(self) -> None:
        """Send a request that could not be sent before; give up one that takes too long."""
        request = self._request
        if request is None:
            return
        if request.handle is None and self._finds_server():
            request.ends = time.monotonic() + self._deadline
            goal = messages.MvpReconfigurationGoal(desired_configuration_name=request.configuration)
            request.handle = self._client.send_goal(goal, lambda handle: self._on_transition(request, handle))
        elif time.monotonic() < request.ends:
            return
        elif request.handle is None:
            name = rospy.resolve_name(self._client.ns)
            self._end(request, False, f"the manipulator's action server {name} is not there", blame=False)
        else:
            request.handle.cancel()
            self._end(request, False, f"no result within {self._deadline:g} s")

    @property
    def next_look(self) -> float:
        """The wall time of the next `look`."""
        if self._request is None:
            return math.inf
        return self._request.ends if self._request.handle is not None else time.monotonic() + _SERVER_LOOK

    def _finds_server(self) -> bool:
        """Tell at once whether the manipulator is connected; actionlib can't look before the clock runs."""
        return not rospy.get_rostime().is_zero() and bool(self._client.wait_for_server(_ONE_LOOK))

    def _on_transition(self, request: _Request, handle: Any) -> None:
        if handle.get_comm_state() != actionlib.CommState.DONE:
            return
        status, text, result = handle.get_goal_status(), handle.get_goal_status_text(), handle.get_result()
        code = result.result if result is not None else None
        self._queue(lambda: self._take_result(request, status, text, code))

    def _take_result(self, request: _Request, status: int, text: str, code: int | None) -> None:
        ok = code == messages.ReconfigurationResult.OK and status == GoalStatus.SUCCEEDED
        reason = text or _MEANINGS.get(-2 if code is None else code, "the manipulator gave no result")
        self._end(request, ok, "" if ok else reason, blame=code in _MEANINGS)

    def _end(self, request: _Request, ok: bool, message: str, *, blame: bool = True) -> None:
        if request is not self._request:
            return  # its result came after the deadline
        self._request = None
        was_in_trouble = bool(self._trouble)
        self._failures, self._trouble = (0, "") if ok else (self._failures + 1, message)
        self._report(request.decision, ok, message, blame=blame)
        if was_in_trouble or not ok:
            self.tell_trouble(is_over=ok)

    def tell_trouble(self, *, is_over: bool = False) -> None:
        """Publish a diagnostic while reconfigurations fail, and one more when they succeed again."""
        if not self._trouble and not is_over:
            return
        status = DiagnosticStatus(
            level=DiagnosticStatus.OK if is_over else DiagnosticStatus.ERROR,
            name=f"{rospy.get_name().strip('/')}: reconfiguration",
            message="Reconfiguration works" if is_over else f"Reconfiguration fails: {self._trouble}",
            hardware_id=rospy.get_name(),
            values=[KeyValue("failed attempts in a row", str(self._failures))],
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = rospy.Time.now()
        self._diagnostics.publish(array)
