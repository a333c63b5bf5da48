"""The topic of the reasoner's decisions: the node publishes them, the command `explain` reads the last one."""

from __future__ import annotations

import rospy
from metacontrol_bags import messages
from metacontrol_bags.decision import Decision
from metacontrol_msgs import msg
from node_kit.io.xml_rpc import CallError
from node_kit.ros import command

from mros1_reasoner.replay.recording import RecordingError
from mros1_reasoner.ros.messages import fill_decision

_TOPIC = "mros1_reasoner/decision"


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


def last_decision(topic: str, wait: float) -> Decision:
    """Return the last decision that was published on a latched topic.

    Args:
        topic: its name.
        wait: for so long, s.

    Raises:
        RecordingError: there is no master, or none has come.
    """
    try:
        command.join("explain")
    except CallError as error:
        raise RecordingError(f"{error}: start roscore or set ROS_MASTER_URI, or name a bag") from error
    try:
        return messages.decision(rospy.wait_for_message(topic, msg.Decision, wait), rospy.get_time())
    except (OSError, rospy.ROSException) as error:
        name = rospy.resolve_name(topic)
        say = f"no decision on {name} within {wait:g} s: no reasoner runs, or it has decided nothing yet"
        raise RecordingError(f"{say} ({error})") from error
