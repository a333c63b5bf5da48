"""The action by which tasks ask for objectives."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import actionlib
import rospy
from actionlib_msgs.msg import GoalStatus
from metacontrol_msgs import msg as messages
from metacontrol_msgs.msg import ObjectiveWords as Words
from node_kit.ros.action_server import Sturdy

from mros1_reasoner.knowledge.model_reader import KnowledgeBaseError
from mros1_reasoner.loop.fulfilment import Fulfilment
from mros1_reasoner.loop.goals import End, Goals, Wish
from mros1_reasoner.loop.readable_state import MapeError

NAME = "mros1_reasoner/objective"
_IMPROVE = {Words.AS_SET: None, Words.IMPROVE: True, Words.KEEP: False}
_GOODBYE = 0.3  # s, wall, for the publisher's own thread to send the last results
_BY_CLIENTS = (Words.CANCELLED, Words.REPLACED)  # as in SimpleActionServer, these preempt a goal


class _Server(Sturdy, actionlib.ActionServer):
    """actionlib's, which outlives a clock that is set back."""


class ObjectiveAction:
    """Serves the action. Only callbacks of actionlib, and the end of the node, are outside the loop's thread."""

    def __init__(
        self, goals: Goals, queue: Callable[[Callable[[], object]], object], tell: Callable[[str], object]
    ) -> None:
        """Serve from now on.

        Args:
            goals: decides.
            queue: has the loop's thread do something.
            tell: writes a line to the log.
        """
        self._goals, self._tell = goals, tell
        self._handles: dict[str, Any] = {}
        self._server = _Server(
            NAME,
            messages.ObjectiveAction,
            lambda handle: queue(lambda: self._take(handle)),
            lambda handle: queue(lambda: self._goals.cancel(handle.get_goal_id().id)),
            auto_start=False,
        )
        self._server.start()
        rospy.on_shutdown(self._say_goodbye)

    def look(self) -> None:
        """Tell clients what is new of their goals."""
        for goal, news in self._goals.look(rospy.get_time()):
            if isinstance(news, Fulfilment):
                self._handles[goal].publish_feedback(_feedback(news))
            else:
                self._tell(f"goal of {news.objective} ends ({news.reason}): {news.message}")
                self._end(self._handles.pop(goal), news)

    def _take(self, handle: Any) -> None:
        """Accept or reject a goal."""
        goal, given = handle.get_goal_id().id, handle.get_goal()
        try:
            words = self._goals.ask(goal, _wish(given))
        except (MapeError, KnowledgeBaseError) as error:
            self._tell(f"goal for {given.function!r} is rejected: {error}")
            handle.set_rejected(messages.ObjectiveResult(Words.REJECTED, "", str(error)), str(error))
            return
        self._handles[goal] = handle
        handle.set_accepted(words)

    @staticmethod
    def _end(handle: Any, end: End) -> None:
        result = messages.ObjectiveResult(end.reason, end.objective, end.message)
        (handle.set_canceled if end.reason in _BY_CLIENTS else handle.set_aborted)(result, end.message)

    def _say_goodbye(self) -> None:
        """Abort all goals, past the action server, which sends nothing while rospy shuts down."""
        for handle in list(self._handles.values()):
            words = "the reasoner ends; what it has deployed runs on"
            message = messages.ObjectiveActionResult()
            message.header.stamp = rospy.Time.now()
            message.status = GoalStatus(handle.get_goal_id(), GoalStatus.ABORTED, words)
            message.result = messages.ObjectiveResult(Words.ENDED, "", words)
            self._server.result_pub.publish(message)
        if self._handles:
            time.sleep(_GOODBYE)


def _wish(goal: messages.ObjectiveGoal) -> Wish:
    if goal.always_improve not in _IMPROVE:
        known = ", ".join(map(str, sorted(_IMPROVE)))
        raise MapeError(f"always_improve is {goal.always_improve}: expected one of {known}")
    limits = tuple((nfr.name, nfr.value) for nfr in goal.nfrs)
    return Wish(goal.function, goal.name, limits, _IMPROVE[goal.always_improve], goal.give_up_after)


def _feedback(stands: Fulfilment) -> messages.ObjectiveFeedback:
    return messages.ObjectiveFeedback(
        objective=stands.objective,
        o_status=list(stands.statuses),
        configuration=stands.configuration,
        fulfilled=stands.is_fulfilled,
        violated=list(stands.violated),
        why=stands.why,
    )
