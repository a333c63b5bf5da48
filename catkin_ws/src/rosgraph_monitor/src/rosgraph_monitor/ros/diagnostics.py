"""The topic /diagnostics as the monitor publishes it: each status says whose it is."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from metacontrol_bags import ownership

if TYPE_CHECKING:
    from collections.abc import Sequence

    from diagnostic_msgs.msg import DiagnosticStatus


class DiagnosticsTopic:
    """Publishes statuses of the robot in this node's namespace.

    Attributes:
        robot: the hardware_id of statuses that name no other hardware. In a namespace, all statuses get it, also
            those of observers, which name themselves: in a bag that is played, nothing else tells whose they are.
    """

    def __init__(self) -> None:
        """Offer the topic."""
        self.robot = ownership.hardware_id_of(rospy.get_namespace())
        self._publisher = rospy.Publisher(ownership.TOPIC, DiagnosticArray, queue_size=50)

    def publish(self, statuses: Sequence[DiagnosticStatus], stamp: rospy.Time) -> None:
        """Publish statuses in one array.

        Raises:
            rospy.ROSException: the node ends.
        """
        for status in statuses:
            status.hardware_id = ownership.marked(status.hardware_id, rospy.get_namespace())
        array = DiagnosticArray(status=list(statuses))
        array.header.stamp = stamp
        self._publisher.publish(array)
