"""Node rviz_text: configuration, quality levels and failed components as a text over the robot, for RViz."""

from __future__ import annotations

import threading

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from metacontrol_bags import ownership
from metacontrol_msgs.msg import ActiveConfiguration
from node_kit.ros.lifetime import Lifetime
from visualization_msgs.msg import Marker

from metacontrol_sim.status_text import StatusText

_PERIOD_S = 0.5
_BEHIND_M, _HEIGHT_M = 1.5, 2.0
"""Place of the text: what lies ahead of the robot stays in view."""
_SIZE_M = 0.55
_CALM, _ALARM = (0.0, 0.0, 0.1), (0.8, 0.0, 0.0)
"""Colours that can be read on a map's light floor and on a costmap."""


class RvizTextNode:
    """Publishes rviz/text."""

    def __init__(self) -> None:
        """Connect."""
        self._text = StatusText()
        self._lock = threading.Lock()
        self._marker = rospy.Publisher("rviz/text", Marker, queue_size=1, latch=True)
        self._inputs = (
            rospy.Subscriber(ownership.TOPIC, DiagnosticArray, self._on_diagnostics),
            rospy.Subscriber("rosgraph_manipulator/active_configuration", ActiveConfiguration, self._on_configuration),
        )
        self._timer = rospy.Timer(rospy.Duration.from_sec(_PERIOD_S), lambda _event: self._publish(), reset=True)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        publisher = message._connection_header.get("callerid", "")
        message.status = ownership.own(message.status, rospy.get_namespace(), publisher)
        with self._lock:
            self._text.take_diagnostics(message)

    def _on_configuration(self, message: ActiveConfiguration) -> None:
        with self._lock:
            self._text.take_configuration(message)

    def _publish(self) -> None:
        with self._lock:
            lines, alarm = self._text.lines(), self._text.alarm
        if not lines:
            return
        marker = Marker(ns="status", type=Marker.TEXT_VIEW_FACING, text="\n".join(lines), frame_locked=True)
        marker.header.frame_id = "base_link"
        marker.pose.position.x, marker.pose.position.z = -_BEHIND_M, _HEIGHT_M
        marker.pose.orientation.w = 1.0
        marker.scale.z = _SIZE_M
        marker.color.r, marker.color.g, marker.color.b = _ALARM if alarm else _CALM
        marker.color.a = 1.0
        self._marker.publish(marker)


def main() -> None:
    """Run the node."""
    with Lifetime("rviz_text") as life:
        life.start()
        RvizTextNode()
        rospy.spin()
