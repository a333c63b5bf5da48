"""Wait for a system that is starting: its master, its reasoner, the recorder."""

from __future__ import annotations

import xmlrpc.client
from typing import TYPE_CHECKING, Any

import rosgraph
import rospy
from metacontrol_bags.bag import TOPICS

from metacontrol_experiments.io.processes import wait_until
from metacontrol_experiments.ros.fault_injection import ImpatientTransport

if TYPE_CHECKING:
    from collections.abc import Callable

REASONER = "/reasoner"
DECISION_TOPIC = "mros1_reasoner/decision"

START_S = 90.0
"""Wall seconds that each part has to come up; on two busy cores the whole system takes 10 to 20."""


class StartError(RuntimeError):
    """The system did not come up; the message says what was waited for."""


class Startup:
    """Waits for one part after the other."""

    def __init__(self, attend: Callable[[], None]) -> None:
        """Take what is called again and again meanwhile; it raises an error to give up."""
        self._attend = attend
        self._master = rosgraph.Master("/mission")

    def wait(self, condition: Callable[[], bool], what: str) -> None:
        """Wait for a condition.

        Raises:
            StartError: it did not come true in time; the message says what it is.
        """

        def met() -> bool:
            self._attend()
            return condition()

        if not wait_until(met, START_S):
            raise StartError(f"waited {START_S:g} s in vain for {what}")

    def wait_for_master(self) -> None:
        """Wait for the master and simulated time: before rospy's node begins.

        Raises:
            StartError: it did not come up in time.
        """
        self.wait(self._simulated_time, "the ROS master with /use_sim_time")

    def wait_for_reasoner(self) -> None:
        """Wait until the reasoner has told the master of its decisions.

        Raises:
            StartError: it did not come up in time.
        """
        self.wait(self._decisions_offered, f"the node {REASONER} with its topic {DECISION_TOPIC}")

    def wait_for_recorder(self, recorder: str, *publishers: rospy.Publisher) -> None:
        """Wait until the node `recorder` subscribes to all that is recorded, and is connected to these of this node.

        Raises:
            StartError: it did not come up in time.
        """
        names = {publisher.resolved_name for publisher in publishers}
        self.wait(lambda: self._recorded(recorder, names), f"the recorder {recorder}")

    def _simulated_time(self) -> bool:
        try:
            return bool(self._master.getParam("/use_sim_time"))
        except (OSError, rosgraph.MasterException):  # not up yet, or not set yet
            return False

    def _decisions_offered(self) -> bool:
        publishers, _, _ = self._master.getSystemState()
        return any(topic == rospy.resolve_name(DECISION_TOPIC) and REASONER in nodes for topic, nodes in publishers)

    def _recorded(self, recorder: str, own: set[str]) -> bool:
        _, subscribers, _ = self._master.getSystemState()
        taken = {topic for topic, nodes in subscribers if recorder in nodes}
        return taken.issuperset(TOPICS) and own <= _topics_to(recorder)


def _topics_to(node: str) -> set[str]:
    """Return the topics of this node over which it is connected to a subscriber."""
    with xmlrpc.client.ServerProxy(rospy.get_node_uri(), transport=ImpatientTransport()) as proxy:
        answer: Any = proxy.getBusInfo(rospy.get_name())
    return {topic for _, subscriber, direction, _, topic, *_ in answer[2] if subscriber == node and direction == "o"}
