"""The topic of the reasoner's decisions: the node publishes them, the command `explain` reads the last one."""

from __future__ import annotations

import time
from collections.abc import Callable

import rospy
from metacontrol_bags import messages
from metacontrol_bags.decision import Decision
from metacontrol_msgs import msg
from node_kit.io.xml_rpc import CallError
from node_kit.ros import command

from mros1_reasoner.replay.recording import RecordingError
from mros1_reasoner.ros.messages import fill_decision

_TOPIC = "mros1_reasoner/decision"
_FIND_TIMEOUT = 3.0  # s, wall, to find the reasoner
_LOOK_PERIOD = 0.01  # s, wall


class DecisionTopic:
    """Publishes decisions; a new subscriber gets the last one."""

    def __init__(self) -> None:
        """Offer the topic."""
        self._publisher = rospy.Publisher(_TOPIC, msg.Decision, queue_size=10, latch=True)

    def publish(self, decision: Decision) -> None:
        """Publish a decision."""
        message = fill_decision(msg.Decision(), decision, rospy.Time.from_sec, msg)
        message.header.stamp = rospy.Time.now()
        self._publisher.publish(message)


def last_decision(topic: str, wait: float) -> Decision | None:
    """Return the last decision that was published on a latched topic; None: the reasoner has decided nothing yet.

    Args:
        topic: its name.
        wait: for so long for a decision once the reasoner is connected, s of wall time.

    Raises:
        RecordingError: there is no master, or no reasoner.
    """
    try:
        command.join("explain")
    except CallError as error:
        raise RecordingError(f"{error}: start roscore or set ROS_MASTER_URI, or name a bag") from error
    found: list[msg.Decision] = []
    subscriber = rospy.Subscriber(topic, msg.Decision, found.append)
    if not _becomes(subscriber.get_num_connections, max(_FIND_TIMEOUT, wait)):
        name = rospy.resolve_name(topic)
        raise RecordingError(f"nobody publishes {name}: no reasoner runs there; start it, or name a bag")
    return messages.decision(found[0], rospy.get_time()) if _becomes(lambda: found, wait) else None


def _becomes(condition: Callable[[], object], timeout: float) -> bool:
    """Wait for a condition, at most for so long, s of wall time; return whether it has come true."""
    deadline = time.monotonic() + timeout
    while not condition():
        if rospy.is_shutdown() or time.monotonic() >= deadline:
            return False
        time.sleep(_LOOK_PERIOD)
    return True
