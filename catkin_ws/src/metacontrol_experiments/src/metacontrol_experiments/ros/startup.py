"""Wait for a system that is starting: its master, the node that decides, the recorder."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rosgraph
import rospy
from node_kit.io.xml_rpc import CallError, Client

from metacontrol_experiments.io.processes import wait_until

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

DECISION_TOPIC = "mros1_reasoner/decision"

START_S = 90.0
"""Wall seconds that each part has to come up; on two busy cores the whole system takes 10 to 20."""
_CALL_S = 2.0
"""Wall seconds for an answer of the master, and of a node's own API."""


class StartError(RuntimeError):
    """The system did not come up; the message says what was waited for."""


class Startup:
    """Waits for one part after the other."""

    def __init__(self, attend: Callable[[], None]) -> None:
        """Take what is called again and again meanwhile; it raises an error to give up."""
        self._attend = attend
        self._master = Client(rosgraph.get_master_uri(), "/mission", _CALL_S)

    def wait(self, condition: Callable[[], bool], what: str) -> None:
        """Wait for a condition.

        Raises:
            StartError: it did not come true in time; the message says what it is.
        """

        def met() -> bool:
            self._attend()
            try:
                return condition()
            except CallError:  # not up yet, or too busy
                return False

        if not wait_until(met, START_S):
            raise StartError(f"waited {START_S:g} s for {what}, which did not come")

    def wait_for_master(self) -> None:
        """Wait for the master and simulated time: before rospy's node begins.

        Raises:
            StartError: it did not come up in time.
        """
        self.wait(self._simulated_time, "the ROS master with /use_sim_time")

    def wait_for_decider(self, node: str) -> None:
        """Wait until a node has told the master of its decisions.

        Raises:
            StartError: it did not come up in time.
        """
        name = rospy.resolve_name(node)
        self.wait(lambda: self._offers_decisions(name), f"the node {name} with its topic {DECISION_TOPIC}")

    def wait_for_recorder(self, recorder: str, topics: Collection[str], *publishers: rospy.Publisher) -> None:
        """Wait until the node `recorder` subscribes to these topics, and is connected to these of this node.

        Raises:
            StartError: it did not come up in time.
        """
        names = {publisher.resolved_name for publisher in publishers}
        self.wait(lambda: self._recorded(recorder, topics, names), f"the recorder {recorder}")

    def _simulated_time(self) -> bool:
        return bool(self._master.call("getParam", "/use_sim_time"))

    def _offers_decisions(self, node: str) -> bool:
        publishers, _, _ = self._master.call("getSystemState")
        return any(topic == rospy.resolve_name(DECISION_TOPIC) and node in nodes for topic, nodes in publishers)

    def _recorded(self, recorder: str, topics: Collection[str], own: set[str]) -> bool:
        _, subscribers, _ = self._master.call("getSystemState")
        taken = {topic for topic, nodes in subscribers if recorder in nodes}
        return taken.issuperset(topics) and own <= _topics_to(recorder)


def _topics_to(node: str) -> set[str]:
    """Return the topics of this node over which it is connected to a subscriber."""
    with Client(rospy.get_node_uri(), rospy.get_name(), _CALL_S, peer="node") as api:
        links = api.call("getBusInfo")
    return {topic for _, subscriber, direction, _, topic, *_ in links if subscriber == node and direction == "o"}
