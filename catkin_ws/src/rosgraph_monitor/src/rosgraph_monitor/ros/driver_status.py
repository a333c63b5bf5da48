"""ROS shell of drivers' statuses: hears on /diagnostics how components are."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import genpy
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from metacontrol_bags.ownership import TOPIC, own

from rosgraph_monitor.health.driver_status import DriverStatuses
from rosgraph_monitor.ros.topics import unpacked

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from rosgraph_monitor.health.components import NodeCondition


class DriverStatusListener:
    """Says what drivers tell of their components; subscribes only where a component has such a driver."""

    def __init__(self, names: Mapping[str, str], on_change: Callable[[], None]) -> None:
        """Subscribe.

        Args:
            names: component -> name of its driver's status.
            on_change: is called when a condition changes.
        """
        self._namespace = rospy.get_namespace()
        self._statuses = DriverStatuses(names, self._namespace)
        self._on_change = on_change
        self._subscriber = rospy.Subscriber(TOPIC, DiagnosticArray, self._receive, queue_size=100) if names else None

    @property
    def conditions(self) -> dict[str, NodeCondition]:
        """The condition of each component."""
        return self._statuses.conditions

    @property
    def reasons(self) -> dict[str, str]:
        """What the drivers say of each component that has failed."""
        return self._statuses.reasons

    def _receive(self, msg: Any) -> None:
        publisher = msg._connection_header.get("callerid", "")
        try:
            msg = unpacked(msg, DiagnosticArray)
        except (TypeError, genpy.DeserializationError) as error:
            rospy.logwarn_throttle(10.0, f"{TOPIC}: {error}: left out")
            return
        changes = [self._statuses.take(s.name, s.level, s.message) for s in own(msg.status, self._namespace, publisher)]
        if any(changes):
            self._on_change()
