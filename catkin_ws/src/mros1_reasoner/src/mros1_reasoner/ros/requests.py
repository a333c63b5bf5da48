"""Sends the node reasoner's requests to the manipulator, one at a time, and reports failures."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import actionlib
import rospy
from actionlib_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from metacontrol_bags import ownership
from metacontrol_msgs import msg as messages

_SERVER_WAIT = 1.0  # s, wall, at most, for the connections to the manipulator: after a start they may be on their way
_SERVER_LOOK = 0.02  # s, wall, between two looks whether they are there
_ONE_LOOK = rospy.Duration(0, -1)
_RELEASE_WAIT = 5.0  # s, wall, until a release that has failed is tried again
_CHANGE = "rosgraph_manipulator/change_function"
_MEANINGS = {
    messages.ReconfigurationResult.FAILED: "the manipulator restored the former one",
    messages.ReconfigurationResult.UNKNOWN_CONFIGURATION: "the manipulator does not know it",
}


@dataclass(frozen=True)
class Wanted:
    """What the manipulator is asked for.

    Attributes:
        function: what it is about.
        configuration: to deploy; empty: the function is to be released.
        restart: resolved names of nodes to restart even if they do not differ.
        is_first: nothing runs for the function, so that there is nothing to restore.
    """

    function: str
    configuration: str = ""
    restart: tuple[str, ...] = ()
    is_first: bool = False

    @property
    def needs_more(self) -> bool:
        """Whether the published action can't say it."""
        return bool(self.restart) or not self.configuration


@dataclass
class _Request:
    decision: str  # empty: a release
    wanted: Wanted
    ends: float = 0.0  # wall time
    handle: Any = None  # None: it could not be sent yet


class Requests:
    """Asks the manipulator for configurations. Only callbacks of actionlib run outside the loop's thread."""

    def __init__(
        self,
        action: str,
        deadline: float,
        queue: Callable[[Callable[[], object]], object],
        report: Callable[..., None],
        report_released: Callable[[str], object],
        warn: Callable[[str], None],
    ) -> None:
        """Look for the manipulator from now on.

        Args:
            action: the name of its published action.
            deadline: a request without a result has failed after so long, s of wall time.
            queue: has the loop's thread do something.
            report: is called in the loop's thread when a request has ended, with its decision, whether it was carried
                out, why not, and `blame`: whether that is the configuration's fault.
            report_released: is called in the loop's thread when a function was released.
            warn: tells a problem.
        """
        self._client = actionlib.ActionClient(action, messages.MvpReconfigurationAction)
        self._change = actionlib.ActionClient(_CHANGE, messages.ChangeFunctionAction)
        self._deadline, self._queue, self._warn = deadline, queue, warn
        self._report, self._report_released = report, report_released
        self._diagnostics = rospy.Publisher(ownership.TOPIC, DiagnosticArray, queue_size=10)
        self._request: _Request | None = None
        self._next: _Request | None = None  # a decision that waits for the end of a release
        self._failures, self._trouble = 0, ""
        self._release_after = time.monotonic() + _SERVER_WAIT
        self._has_warned = False

    def ask(self, decision: str, wanted: Wanted) -> None:
        """Ask for a configuration; call `report` when it runs, has failed, or nobody has answered in time."""
        request = _Request(decision, wanted)
        if self._request is not None and not self._request.decision:
            self._next = request
        else:
            self._begin(request)

    def release(self, functions: Sequence[str]) -> None:
        """Have the first one of some functions released, unless something else is under way."""
        if not functions or self._request is not None or time.monotonic() < self._release_after:
            return
        if self._finds(self._change):
            self._begin(_Request("", Wanted(functions[0])))
        else:
            self._release_after = time.monotonic() + _RELEASE_WAIT
            self._warn_of_absence(f"{', '.join(functions)} can't be released and may go on running")

    def keep_what_runs(self, function: str) -> None:
        """Give up a request for the first configuration of a function that could not be sent yet: something runs."""
        request = self._request
        if request and request.handle is None and request.wanted.is_first and request.wanted.function == function:
            self._end(request, False, "a configuration runs already", blame=False)

    def look(self) -> None:
        """Send a request that could not be sent before; give up one that takes too long."""
        request = self._request
        if request is None:
            return
        if request.handle is None and (client := self._client_for(request)):
            request.ends = time.monotonic() + self._deadline
            request.handle = client.send_goal(
                self._goal(client, request.wanted), lambda handle: self._on_transition(request, handle)
            )
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

    def _begin(self, request: _Request) -> None:
        request.ends = time.monotonic() + _SERVER_WAIT
        self._request = request
        self.look()

    def _client_for(self, request: _Request) -> actionlib.ActionClient | None:
        """Return the action by which a request can be made now; None if there is none yet."""
        if request.wanted.needs_more:
            if self._finds(self._change):
                return self._change
            if time.monotonic() < request.ends or not request.wanted.configuration:
                return None
            self._warn_of_absence(f"{', '.join(request.wanted.restart)} may go on hanging")
        return self._client if self._finds(self._client) else None

    def _goal(self, client: actionlib.ActionClient, wanted: Wanted) -> Any:
        if client is self._change:
            return messages.ChangeFunctionGoal(wanted.function, wanted.configuration, list(wanted.restart))
        return messages.MvpReconfigurationGoal(desired_configuration_name=wanted.configuration)

    def _finds(self, client: actionlib.ActionClient) -> bool:
        """Tell at once whether the manipulator is connected; actionlib can't look before the clock runs."""
        return not rospy.get_rostime().is_zero() and bool(client.wait_for_server(_ONE_LOOK))

    def _warn_of_absence(self, what_follows: str) -> None:
        if not self._has_warned:
            self._has_warned = True
            name = rospy.resolve_name(_CHANGE)
            self._warn(f"the manipulator has no action {name}: {what_follows}: update rosgraph_manipulator")

    def _on_transition(self, request: _Request, handle: Any) -> None:
        if handle.get_comm_state() != actionlib.CommState.DONE:
            return
        status, text, result = handle.get_goal_status(), handle.get_goal_status_text(), handle.get_result()
        code = result.result if result is not None else None
        text = text or getattr(result, "message", "")
        self._queue(lambda: self._take_result(request, status, text, code))

    def _take_result(self, request: _Request, status: int, text: str, code: int | None) -> None:
        ok = code == messages.ReconfigurationResult.OK and status == GoalStatus.SUCCEEDED
        reason = text or _MEANINGS.get(-2 if code is None else code, "the manipulator gave no result")
        # Where nothing ran before there is nothing to restore, which is a general error.
        failed_first = request.wanted.is_first and code == messages.ReconfigurationResult.GENERAL_ERROR
        self._end(request, ok, "" if ok else reason, blame=code in _MEANINGS or failed_first)

    def _end(self, request: _Request, ok: bool, message: str, *, blame: bool = True) -> None:
        if request is not self._request:
            return  # its result came after the deadline
        self._request = None
        if request.decision:
            was_in_trouble = bool(self._trouble)
            self._failures, self._trouble = (0, "") if ok else (self._failures + 1, message)
            self._report(request.decision, ok, message, blame=blame)
            if was_in_trouble or not ok:
                self.tell_trouble(is_over=ok)
        elif ok:
            self._report_released(request.wanted.function)
        else:
            self._release_after = time.monotonic() + _RELEASE_WAIT
            self._warn(f"{request.wanted.function} was not released: {message}: it is tried again")
        if self._next is not None:
            waiting, self._next = self._next, None
            self._begin(waiting)

    def tell_trouble(self, *, is_over: bool = False) -> None:
        """Publish a diagnostic while reconfigurations fail, and one more when they succeed again."""
        if not self._trouble and not is_over:
            return
        status = DiagnosticStatus(
            level=DiagnosticStatus.OK if is_over else DiagnosticStatus.ERROR,
            name=f"{rospy.get_name().strip('/')}: reconfiguration",
            message="Reconfiguration works" if is_over else f"Reconfiguration fails: {self._trouble}",
            hardware_id=ownership.hardware_id_of(rospy.get_namespace()),
            values=[KeyValue("failed attempts in a row", str(self._failures))],
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = rospy.Time.now()
        self._diagnostics.publish(array)
