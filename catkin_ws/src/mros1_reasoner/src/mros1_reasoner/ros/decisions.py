"""The reasoner's decisions: the node publishes them and keeps the last ones, the command `explain` reads them."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

import rospy
from metacontrol_bags import messages
from metacontrol_bags.decision import Decision
from metacontrol_msgs import msg
from metacontrol_msgs.srv import LastDecisions, LastDecisionsResponse
from node_kit.io.xml_rpc import CallError
from node_kit.ros import command
from node_kit.ros.services import SERVICE_FAILURES, call_within

from mros1_reasoner.replay.recording import RecordingError
from mros1_reasoner.ros.messages import fill_decision

_TOPIC = "mros1_reasoner/decision"
_PLURAL = "s"  # the service has the topic's name with it
_KEPT = 100  # decisions
_FIND_TIMEOUT = 3.0  # s, wall, to find the reasoner
_LOOK_PERIOD = 0.01  # s, wall


class DecisionTopic:
    """Publishes decisions; a new subscriber gets the last one."""

    def __init__(self) -> None:
        """Offer the topic."""
        self._kept: dict[str, msg.Decision] = {}  # the last message about each, by its id
        self._lock = threading.Lock()
        self._publisher = rospy.Publisher(_TOPIC, msg.Decision, queue_size=10, latch=True)

    def publish(self, decision: Decision) -> None:
        """Publish a decision."""
        message = fill_decision(msg.Decision(), decision, rospy.Time.from_sec, msg)
        message.header.stamp = rospy.Time.now()
        with self._lock:
            self._kept[decision.id] = message
            if len(self._kept) > _KEPT:
                del self._kept[next(iter(self._kept))]
        self._publisher.publish(message)

    def offer_last(self) -> None:
        """Offer the service that tells the last hundred: only one node of a robot can."""
        self._service = rospy.Service(f"{_TOPIC}{_PLURAL}", LastDecisions, self._tell_last)

    def _tell_last(self, request: Any) -> LastDecisionsResponse:
        with self._lock:
            return LastDecisionsResponse(list(self._kept.values())[-request.last :])


def last_decisions(topic: str, count: int, wait: float) -> list[Decision]:
    """Return the last decisions of a running reasoner, the oldest first, each with its last state.

    Args:
        topic: of its decisions.
        count: how many at most.
        wait: for the reasoner, s of wall time.

    Raises:
        RecordingError: there is no master, or no reasoner that keeps its decisions.
    """
    _join()
    name = rospy.resolve_name(topic) + _PLURAL
    try:
        found = call_within(max(_FIND_TIMEOUT, wait), name, LastDecisions, count).decisions
    except SERVICE_FAILURES as error:
        raise RecordingError(f"{error}: no reasoner runs there, or it hangs; start it, or name a bag") from error
    return [messages.decision(message, rospy.get_time()) for message in found]


def last_decision(topic: str, wait: float) -> Decision | None:
    """Return the last decision that was published on a latched topic; None: the reasoner has decided nothing yet.

    Args:
        topic: its name.
        wait: for so long for a decision once the reasoner is connected, s of wall time.

    Raises:
        RecordingError: there is no master, or no reasoner.
    """
    _join()
    found: list[msg.Decision] = []
    subscriber = rospy.Subscriber(topic, msg.Decision, found.append)
    if not _becomes(subscriber.get_num_connections, max(_FIND_TIMEOUT, wait)):
        name = rospy.resolve_name(topic)
        raise RecordingError(f"nobody publishes {name}: no reasoner runs there; start it, or name a bag")
    return messages.decision(found[0], rospy.get_time()) if _becomes(lambda: found, wait) else None


def _join() -> None:
    """Become an anonymous node.

    Raises:
        RecordingError: there is no master.
    """
    try:
        command.join("explain")
    except CallError as error:
        raise RecordingError(f"{error}: start roscore or set ROS_MASTER_URI, or name a bag") from error


def _becomes(condition: Callable[[], object], timeout: float) -> bool:
    """Wait for a condition, at most for so long, s of wall time; return whether it has come true."""
    deadline = time.monotonic() + timeout
    while not condition():
        if rospy.is_shutdown() or time.monotonic() >= deadline:
            return False
        time.sleep(_LOOK_PERIOD)
    return True
