"""Sends the node reasoner's requests to the manipulator; `loop.requesting` decides when, and what their end means."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import actionlib
import rospy
from actionlib_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from metacontrol_bags import ownership
from metacontrol_msgs import msg as messages

from mros1_reasoner.loop.requesting import Answer, Handle, Requesting, Wanted

_ONE_LOOK = rospy.Duration(0, -1)
_CHANGE = "rosgraph_manipulator/change_function"
_Queue = Callable[[Callable[[], object]], object]


class _Action:
    """An action of the manipulator. Callbacks of actionlib run outside the loop's thread."""

    def __init__(self, action: str, kind: Any, goal: Callable[[Wanted], Any], queue: _Queue) -> None:
        self._client = actionlib.ActionClient(action, kind)
        self._goal, self._queue = goal, queue

    @property
    def name(self) -> str:
        """Full name of the action."""
        return str(rospy.resolve_name(self._client.ns))

    def is_there(self) -> bool:
        """Tell at once whether the manipulator is connected; actionlib can't look before the clock runs."""
        return not rospy.get_rostime().is_zero() and bool(self._client.wait_for_server(_ONE_LOOK))

    def send(self, wanted: Wanted, done: Callable[[Answer], object]) -> Handle:
        """Send a goal; have `done` called in the loop's thread when it has ended."""
        return _Goal(self._client.send_goal(self._goal(wanted), partial(self._on_transition, done)))

    def _on_transition(self, done: Callable[[Answer], object], handle: Any) -> None:
        if handle.get_comm_state() != actionlib.CommState.DONE:
            return
        text, result = handle.get_goal_status_text(), handle.get_result()
        code = result.result if result is not None else None
        succeeded = handle.get_goal_status() == GoalStatus.SUCCEEDED
        answer = Answer(succeeded, text or getattr(result, "message", ""), code)
        self._queue(lambda: done(answer))


class _Goal:
    """A goal of actionlib, which finds a goal lost only once its server has told of it."""

    def __init__(self, handle: Any) -> None:
        self._handle = handle

    def is_acknowledged(self) -> bool:
        """Tell whether the manipulator has told of it."""
        return bool(self._handle.get_comm_state() != actionlib.CommState.WAITING_FOR_GOAL_ACK)

    def cancel(self) -> None:
        """Take it back."""
        self._handle.cancel()


class Requests(Requesting):
    """Asks the manipulator for configurations by its actions."""

    def __init__(
        self,
        action: str,
        deadline: float,
        queue: _Queue,
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
        self._diagnostics = rospy.Publisher(ownership.TOPIC, DiagnosticArray, queue_size=10)
        super().__init__(
            _Action(action, messages.MvpReconfigurationAction, _configuration_goal, queue),
            _Action(_CHANGE, messages.ChangeFunctionAction, _function_goal, queue),
            deadline,
            time.monotonic,
            report,
            report_released,
            warn,
            self._publish_trouble,
        )

    def _publish_trouble(self, failures: int, reason: str) -> None:
        """Publish a diagnostic while reconfigurations fail, and one more when they succeed again."""
        status = DiagnosticStatus(
            level=DiagnosticStatus.ERROR if failures else DiagnosticStatus.OK,
            name=f"{rospy.get_name().strip('/')}: reconfiguration",
            message=f"Reconfiguration fails: {reason}" if failures else "Reconfiguration works",
            hardware_id=ownership.hardware_id_of(rospy.get_namespace()),
            values=[KeyValue("failed attempts in a row", str(failures))],
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = rospy.Time.now()
        self._diagnostics.publish(array)


def _configuration_goal(wanted: Wanted) -> messages.MvpReconfigurationGoal:
    return messages.MvpReconfigurationGoal(desired_configuration_name=wanted.configuration)


def _function_goal(wanted: Wanted) -> messages.ChangeFunctionGoal:
    return messages.ChangeFunctionGoal(wanted.function, wanted.configuration, list(wanted.restart))
