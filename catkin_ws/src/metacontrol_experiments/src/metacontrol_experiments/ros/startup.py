"""Wait for a system that is starting: its master, the node that decides, the recorder."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rosgraph
import rospy
from node_kit.io.xml_rpc import CallError, Client, DeniedError, GoneError

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
        """Wait until the node `recorder` subscribes to these topics, and whoever publishes them is connected to it.

        Args:
            recorder: its name.
            topics: what it records.
            publishers: of this node; there may be more than the master knows of yet.

        Raises:
            StartError: it did not come up in time.
        """
        own = {publisher.resolved_name for publisher in publishers}
        self.wait(lambda: self._subscribed(recorder, topics), f"the recorder {recorder}")
        self.wait(
            lambda: self._connected(recorder, topics, own),
            f"connections from all who publish what is recorded to the recorder {recorder}",
        )

    def _simulated_time(self) -> bool:
        return bool(self._master.call("getParam", "/use_sim_time"))

    def _offers_decisions(self, node: str) -> bool:
        publishers, _, _ = self._master.call("getSystemState")
        return any(topic == rospy.resolve_name(DECISION_TOPIC) and node in nodes for topic, nodes in publishers)

    def _subscribed(self, recorder: str, topics: Collection[str]) -> bool:
        _, subscribers, _ = self._master.call("getSystemState")
        return {topic for topic, nodes in subscribers if recorder in nodes}.issuperset(topics)

    def _connected(self, recorder: str, topics: Collection[str], own: set[str]) -> bool:
        publishers, _, _ = self._master.call("getSystemState")
        offered = {rospy.get_name(): own}
        for topic, nodes in publishers:
            if topic in topics:
                for node in nodes:
                    offered.setdefault(node, set()).add(topic)
        offered.pop(recorder, None)
        return all(wanted <= self._topics_to(recorder, node, wanted) for node, wanted in offered.items())

    def _topics_to(self, subscriber: str, node: str, wanted: set[str]) -> set[str]:
        """Return the topics over which a node is connected to a subscriber; `wanted` of one that has ended."""
        try:
            with Client(self._master.call("lookupNode", node), rospy.get_name(), _CALL_S, peer="node") as api:
                links = api.call("getBusInfo")
        except (DeniedError, GoneError):
            return wanted
        return {topic for _, peer, direction, _, topic, *_ in links if peer == subscriber and direction == "o"}
