"""Asks the reasoner for a function while a task needs it; for missions of any kind."""

from __future__ import annotations

import enum
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import actionlib
import rospy
from actionlib_msgs.msg import GoalStatus
from metacontrol_msgs import msg as messages
from metacontrol_msgs.msg import ObjectiveWords as Words

ACTION = "mros1_reasoner/objective"
_ONE_LOOK = rospy.Duration(0, -1)
_PATIENCE = 5.0  # s, wall, until a goal that no reasoner has acknowledged is sent again
_PERIOD = 0.05  # s, wall, between two looks of `wait`
_IMPROVE = {None: Words.AS_SET, True: Words.IMPROVE, False: Words.KEEP}


@dataclass(frozen=True)
class Need:
    """What a task needs.

    Attributes:
        function: name of the TOMASys Function.
        limits: by quality, the limit, or the two limits of a band, the least first.
        name: of the objective; empty: that of the function's objective, or a new one.
        always_improve: adapt also when nothing is wrong but a better design is available; None: as the reasoner is set.
        give_up_after: end when the function has not been fulfilled for so long, s of ROS time; 0: never.
    """

    function: str
    limits: Mapping[str, float | tuple[float, float]] = field(default_factory=dict)
    name: str = ""
    always_improve: bool | None = None
    give_up_after: float = 0.0


class Standing(enum.Enum):
    """How a need stands."""

    IDLE = "is not asked for"
    WAITING = "waits for the reasoner"
    UNFULFILLED = "is asked for, and not fulfilled"
    FULFILLED = "is fulfilled"
    ENDED = "is pursued no longer, although it is needed"


class Asking:
    """Asks for one function from `begin` to `end`, and again if the reasoner was started anew.

    Nothing here waits but `wait`. The node must have been initialised.

    Attributes:
        words: how the need stands, in one line.
        result: result of the goal that has ended; None: it has not.
    """

    def __init__(self, need: Need, action: str = ACTION) -> None:
        """Connect to the reasoner, but ask for nothing yet.

        Args:
            need: what to ask for.
            action: name of the reasoner's action.
        """
        self._goal = _goal(need)
        self._client = actionlib.ActionClient(action, messages.ObjectiveAction)
        self._handle: Any = None
        self._feedback: messages.ObjectiveFeedback | None = None
        self._sent, self._is_needed = 0.0, False
        self.words, self.result = "", None

    def begin(self) -> None:
        """Ask from now on; nothing changes if it is asked already."""
        if not self._is_needed:
            self._is_needed, self._handle, self.result = True, None, None

    def end(self) -> None:
        """Give the function up."""
        if self._is_needed:
            self._is_needed = False
            if self._handle is not None and self._handle.get_comm_state() != actionlib.CommState.DONE:
                self._handle.cancel()

    def look(self) -> Standing:
        """Return how the need stands now; ask for it if that is still to be done."""
        if not self._is_needed:
            return Standing.IDLE
        if self._handle is not None and self._is_lost():
            self._handle = None
        if self._handle is None and not self._send():
            self.words = f"no reasoner serves {rospy.resolve_name(self._client.ns)}: it is waited for"
            return Standing.WAITING
        if self._handle.get_comm_state() == actionlib.CommState.DONE:
            self.result = self._handle.get_result()
            self.words = self._handle.get_goal_status_text() or "no reason given"
            return Standing.ENDED
        known = self._feedback
        if known is None:
            self.words = "the reasoner has not answered yet"
            return Standing.WAITING
        self.words = known.why or f"{known.objective} has {known.configuration}"
        return Standing.FULFILLED if known.fulfilled else Standing.UNFULFILLED

    def wait(self, patience: float) -> bool:
        """Wait until the reasoner has taken note of the end, at most for so long, s of wall time; return whether so."""
        until = time.monotonic() + patience
        while self._handle is not None and self._handle.get_comm_state() != actionlib.CommState.DONE:
            if rospy.is_shutdown() or time.monotonic() >= until:
                return False
            time.sleep(_PERIOD)
        return True

    def _send(self) -> bool:
        """Send the goal, if a reasoner is there; actionlib can't look before the clock runs."""
        if rospy.get_rostime().is_zero() or not self._client.wait_for_server(_ONE_LOOK):
            return False
        self._feedback, self._sent = None, time.monotonic()
        self._handle = self._client.send_goal(self._goal, feedback_cb=self._take_feedback)
        return True

    def _take_feedback(self, handle: Any, feedback: messages.ObjectiveFeedback) -> None:
        if handle == self._handle or self._handle is None:
            self._feedback = feedback

    def _is_lost(self) -> bool:
        """Return whether the reasoner does not know the goal any more, or never has."""
        state = self._handle.get_comm_state()
        if state == actionlib.CommState.WAITING_FOR_GOAL_ACK:
            return time.monotonic() - self._sent > _PATIENCE
        if state != actionlib.CommState.DONE:
            return False
        result = self._handle.get_result()
        return self._handle.get_goal_status() == GoalStatus.LOST or (
            result is not None and result.reason == Words.ENDED
        )


def _goal(need: Need) -> messages.ObjectiveGoal:
    limits: list[messages.ExpectedQA] = []
    for quality, given in need.limits.items():
        levels = given if isinstance(given, tuple | list) else (given,)
        limits += [messages.ExpectedQA(name=quality, value=float(level)) for level in levels]
    return messages.ObjectiveGoal(
        function=need.function,
        name=need.name,
        nfrs=limits,
        always_improve=_IMPROVE[need.always_improve],
        give_up_after=need.give_up_after,
    )
